"""Figures of the simulated arm's whole shape: the paper's figures 4 to 7, for arms of links or pieces and paths of the tip."""
import numpy as np
from matplotlib.lines import Line2D

from .run_log import ShapeLog, wrapped
from .style import CATEGORY, ESTIMATE, REFERENCE, at_least, finish, plt, thinned, time_axes

MAX_ROWS = 8
REFERENCE_STYLE = {"color": REFERENCE, "linestyle": (0, (4, 2)), "linewidth": 1.0}
FIT_STYLE = {"color": CATEGORY[0], "linewidth": 1.5}
PART_STYLE = {"color": ESTIMATE, "linewidth": 0.7}
SNAPSHOTS = 8


def _close_to(phi, neighbour):
    """phi on the turn that is closest to a neighbour's, which is continuous."""
    known = np.flatnonzero(np.isfinite(neighbour))
    if not known.size:
        return phi
    filled = np.interp(np.arange(len(phi)), known, neighbour[known])
    return filled + wrapped(phi - filled)


def _continuous(phi):
    result = phi.copy()
    valid = np.isfinite(result)
    result[valid] = np.unwrap(result[valid])
    return result


def has_parts(log):
    """Whether the arm has more parts than the model has segments, so that the model is a fit."""
    shape = ShapeLog.of(log)
    return shape is not None and shape.parts > log.segments and shape.parts % log.segments == 0


def _posture(log, directory, which, name, number):
    """One row a segment: every part's angle, that of the PCC fit, the reference's."""
    if not has_parts(log) or log.true_u is None:
        return None
    shape = ShapeLog.of(log)
    per_segment = shape.parts // log.segments
    t, true_u, reference = thinned(log.t_s, log.true_u, log.reference)
    fit = log.polar(true_u)
    wanted = None if reference is None else log.polar(reference)
    # A part bends by its share of the segment's angle.
    parts = log.polar(per_segment * shape.bends)
    rows = min(log.segments, MAX_ROWS)
    figure, grid = plt.subplots(rows, 1, figsize=(11, 0.9 + 1.75 * rows), sharex=True, squeeze=False)
    for segment in range(rows):
        axes = grid[segment][0]
        values = fit[which][:, segment]
        if which == 1:
            values = _continuous(values)
        at_parts = np.interp(shape.t_s, t, values)
        for part in range(segment * per_segment, (segment + 1) * per_segment):
            angle = parts[which][:, part]
            axes.plot(shape.t_s, angle if which == 0 else _close_to(angle, at_parts), **PART_STYLE)
        axes.plot(t, values, **FIT_STYLE)
        if wanted is not None:
            angle = wanted[which][:, segment]
            axes.plot(t, angle if which == 0 else _close_to(angle, values), **REFERENCE_STYLE)
        symbol = "\\theta" if which == 0 else "\\phi"
        axes.set_ylabel(f"${symbol}_{{{segment + 1}}}$ [rad]")
        at_least(axes, 0.05 if which == 0 else 0.5)
    modes = time_axes(grid, log)
    share = f"links, $\\theta \\times {per_segment}$" if which == 0 else "links"
    handles = [Line2D([], [], label="reference", **REFERENCE_STYLE), Line2D([], [], label="PCC fit", **FIT_STYLE),
               Line2D([], [], label=share, **PART_STYLE)]
    finish(figure, directory / name, ("Bending angle" if which == 0 else "Direction of bending") + " of links and fit",
           handles + modes)
    what = "bending angle, times their number in a segment," if which == 0 else "direction of bending, where they bend,"
    return name, (f"The {what} of all links of every segment; of the constant-curvature segment that fits the "
                  f"segment's end; and the reference's (the paper's figure {number}).")


def figure4(log, directory):
    """phi of links, fit and reference, as in the paper's figure 4."""
    return _posture(log, directory, 1, "figure4.png", 4)


def figure5(log, directory):
    """theta of links, fit and reference, as in the paper's figure 5."""
    return _posture(log, directory, 0, "figure5.png", 5)


def _follows_tip_path(log):
    return "tip_near_after_s" in log.summary.get("tracking", {}) and log.tip_m is not None \
        and log.tip_reference_m is not None


def _plane_axes(path):
    """The two world axes along which a path extends most, in order."""
    extent = np.ptp(path[np.isfinite(path).all(axis=1)], axis=0)
    return sorted(np.argsort(extent)[1:])


def figure6(log, directory):
    """The tip's path against its reference, and its error over time: the paper's figure 6."""
    if not _follows_tip_path(log):
        return None
    t, tip, wanted = thinned(log.t_s, log.tip_m, log.tip_reference_m)
    figure, (plane, over_time) = plt.subplots(1, 2, figsize=(11, 4.6))
    a, b = _plane_axes(wanted)
    plane.plot(1e3 * tip[:, a], 1e3 * tip[:, b], **FIT_STYLE)
    plane.plot(1e3 * wanted[:, a], 1e3 * wanted[:, b], **REFERENCE_STYLE)
    plane.scatter(1e3 * tip[0, a], 1e3 * tip[0, b], color=CATEGORY[1], s=24, zorder=3)
    plane.set_aspect("equal", adjustable="datalim")
    plane.set_xlabel(f"{'xyz'[a]} [mm]")
    plane.set_ylabel(f"{'xyz'[b]} [mm]")
    over_time.semilogy(t, np.maximum(1e3 * np.linalg.norm(tip - wanted, axis=1), 1e-3), **FIT_STYLE)
    over_time.axhline(10.0, color=CATEGORY[1], linewidth=0.8)
    over_time.set_xlabel("time [s]")
    over_time.set_ylabel("distance of the tip from the reference [mm]")
    over_time.set_xlim(t[0], t[-1])
    handles = [Line2D([], [], label="reference", **REFERENCE_STYLE), Line2D([], [], label="tip", **FIT_STYLE),
               Line2D([], [], color=CATEGORY[1], marker="o", linestyle="", markersize=5, label="start"),
               Line2D([], [], color=CATEGORY[1], linewidth=0.8, label="10 mm")]
    finish(figure, directory / "figure6.png", "Tip against reference", handles)
    return "figure6.png", "Path of the tip against the one asked for, and the distance between (the paper's figure 6)."


def figure7(log, directory):
    """Snapshots of the whole arm in space: the paper's figure 7."""
    shape = ShapeLog.of(log)
    active = np.flatnonzero(log.mode == "ACTIVE")
    if shape is None or not active.size or not _follows_tip_path(log):
        return None
    begin, end = log.t_s[active[0]], log.t_s[active[-1]]
    times = np.linspace(begin, end, 2 * SNAPSHOTS + 1)  # the approach, then the path
    figure = plt.figure(figsize=(11, 5.6))
    wanted = log.tip_reference_m[np.isfinite(log.tip_reference_m).all(axis=1)]
    low = np.minimum(shape.points.min(axis=(0, 1)), wanted.min(axis=0))
    high = np.maximum(shape.points.max(axis=(0, 1)), wanted.max(axis=0))
    extent = np.maximum(high - low, 0.3 * (high - low).max())
    middle = (high + low) / 2
    per_segment = (shape.points.shape[1] - 1) // log.segments
    views = ((14, -58, 0.93, "in space"), (0, 0, 1.15, "along the x axis"))
    for column, (elevation, azimuth, zoom, title) in enumerate(views):
        axes = figure.add_subplot(1, 2, column + 1, projection="3d", proj_type="ortho")
        axes.plot(*wanted.T, **REFERENCE_STYLE)
        axes.plot(*log.tip_m[active].T, color=CATEGORY[4], linewidth=0.8)
        for k, time in enumerate(times):
            points = shape.points[np.argmin(np.abs(shape.t_s - time))]
            for segment in range(log.segments):
                part = points[segment * per_segment:(segment + 1) * per_segment + 1]
                axes.plot(*part.T, color=CATEGORY[segment % len(CATEGORY)], linewidth=1.6,
                          alpha=0.25 + 0.75 * k / (len(times) - 1))
        for axis, name in enumerate("xyz"):
            getattr(axes, f"set_{name}lim")(middle[axis] - 0.52 * extent[axis], middle[axis] + 0.52 * extent[axis])
            getattr(axes, f"set_{name}label")(f"{name} [m]")
            getattr(axes, f"{name}axis").set_pane_color((0.965, 0.975, 0.985, 1.0))
        axes.set_box_aspect(extent, zoom=zoom)
        axes.view_init(elev=elevation, azim=azimuth)
        axes.locator_params(nbins=4)
        if column == 1:
            axes.set_xticks([])
            axes.set_xlabel("")
        axes.set_title(title)
    handles = [Line2D([], [], color=CATEGORY[i % len(CATEGORY)], linewidth=1.6, label=f"segment {i + 1}")
               for i in range(min(log.segments, 6))]
    handles += [Line2D([], [], color=CATEGORY[4], linewidth=0.8, label="tip"),
                Line2D([], [], label="reference", **REFERENCE_STYLE)]
    finish(figure, directory / "figure7.png", "The arm on its way", handles)
    return "figure7.png", ("Snapshots of the arm, the later the darker, with the path of its tip and the reference "
                           "(the paper's figure 7).")


ALL = (figure4, figure5, figure6, figure7)
