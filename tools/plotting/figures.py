"""The figures of a run. Every function takes the log and the folder, and returns (file name, caption) or None."""
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator

from . import shapes
from .run_log import wrapped
from .style import CATEGORY, COMPONENT, ESTIMATE, INK, REFERENCE, at_least, finish, plt, thinned, time_axes

MAX_ROWS = 8  # segments that one figure shows
REFERENCE_STYLE = {"color": REFERENCE, "linestyle": (0, (4, 2)), "linewidth": 1.0}
ARM_STYLE = {"color": CATEGORY[0], "linewidth": 1.3}
ESTIMATE_STYLE = {"color": ESTIMATE, "linewidth": 2.2}


def _shown_segments(log):
    if log.segments <= MAX_ROWS:
        return list(range(log.segments))
    return sorted({int(round(i)) for i in np.linspace(0, log.segments - 1, MAX_ROWS)})


def _selection_note(log):
    return "" if log.segments <= MAX_ROWS else f" ({MAX_ROWS} of {log.segments} segments)"


def _grid(rows, columns, row_height=1.75, **kwargs):
    return plt.subplots(rows, columns, figsize=(11, 0.9 + row_height * rows), sharex=True, squeeze=False, **kwargs)


def _has_truth(log):
    return log.true_u is not None


def _source_handles(log):
    handles = []
    if log.reference is not None:
        handles.append(Line2D([], [], label="reference", **REFERENCE_STYLE))
    if _has_truth(log):
        handles.append(Line2D([], [], label="arm", **ARM_STYLE))
    handles.append(Line2D([], [], label="estimate", **(ESTIMATE_STYLE if _has_truth(log) else ARM_STYLE)))
    return handles


def _near(phi, phi_reference):
    """phi on the turn that is closest to the reference; without one, unwrapped where it is valid."""
    known = np.zeros(0, dtype=int) if phi_reference is None else np.flatnonzero(np.isfinite(phi_reference))
    if not known.size:
        return _unwrapped(phi)
    # Where the reference is straight or absent, its neighbours in time determine the turn.
    filled = np.interp(np.arange(len(phi)), known, phi_reference[known])
    return filled + wrapped(phi - filled)


def _unwrapped(phi):
    result = phi % (2 * np.pi)
    valid = np.isfinite(result)
    result[valid] = np.unwrap(result[valid])
    return result


def _segment_colour(index):
    return CATEGORY[index % len(CATEGORY)]


def figure9(log, directory):
    """phi and theta of every segment against the reference, as in the paper's figure 9."""
    if log.u is None or shapes.has_parts(log):  # then figures 4 and 5 show more
        return None
    shown = _shown_segments(log)
    figure, grid = _grid(len(shown), 2)
    t, u, true_u, reference = thinned(log.t_s, log.u, log.true_u, log.reference)
    estimate, truth, wanted = (None if values is None else log.polar(values) for values in (u, true_u, reference))
    for row, segment in enumerate(shown):
        theta_axes, phi_axes = grid[row]
        phi_wanted = None if wanted is None else _unwrapped(wanted[1][:, segment])
        for values, style in ((estimate, ESTIMATE_STYLE if truth else ARM_STYLE), (truth, ARM_STYLE)):
            if values is not None:
                theta_axes.plot(t, values[0][:, segment], **style)
                phi_axes.plot(t, _near(values[1][:, segment], phi_wanted), **style)
        if wanted is not None:
            theta_axes.plot(t, wanted[0][:, segment], **REFERENCE_STYLE)
            phi_axes.plot(t, phi_wanted, **REFERENCE_STYLE)
        theta_axes.set_ylabel(f"$\\theta_{{{segment + 1}}}$ [rad]")
        phi_axes.set_ylabel(f"$\\phi_{{{segment + 1}}}$ [rad]")
        at_least(theta_axes, 0.05)
        at_least(phi_axes, 0.5)
        theta_axes.set_ylim(bottom=0)
    modes = time_axes(grid, log)
    grid[0][0].set_title("bending angle")
    grid[0][1].set_title("direction of bending, where the angle is above 0.05 rad")
    finish(figure, directory / "figure9.png", "Posture" + _selection_note(log), _source_handles(log) + modes)
    return "figure9.png", "Bending angle and direction of every segment against the reference (the paper's figure 9)."


def curvature(log, directory):
    """u of every segment and its error."""
    if log.u is None:
        return None
    error = log.error()
    shown = _shown_segments(log)
    figure, grid = _grid(len(shown), 2 if error is not None else 1)
    t, u, true_u, reference, error = thinned(log.t_s, log.u, log.true_u, log.reference, error)
    for row, segment in enumerate(shown):
        axes = grid[row][0]
        for k in range(2):
            if true_u is not None:
                axes.plot(t, u[:, segment, k], **ESTIMATE_STYLE)
            axes.plot(t, (u if true_u is None else true_u)[:, segment, k], color=COMPONENT[k])
            if reference is not None:
                axes.plot(t, reference[:, segment, k], **REFERENCE_STYLE)
        axes.set_ylabel(f"$u_{{{segment + 1}}}$ [rad]")
        at_least(axes, 0.02)
        if error is not None:
            axes = grid[row][1]
            for k in range(2):
                axes.plot(t, 1e3 * error[:, segment, k], color=COMPONENT[k], linewidth=0.9)
            axes.set_ylabel("error [mrad]")
            at_least(axes, 0.2)
            _limit_to_active(axes, log, t, 1e3 * error[:, segment])
    modes = time_axes(grid, log)
    grid[0][0].set_title("$u = \\theta\\,(\\cos\\phi, \\sin\\phi)$")
    if error is not None:
        grid[0][1].set_title("reference minus " + ("arm" if _has_truth(log) else "estimate"))
    components = [Line2D([], [], color=COMPONENT[k], label=f"$u_{axis}$") for k, axis in enumerate("xy")]
    shown_by_colour = "arm" if _has_truth(log) else "estimate"
    rest = [handle for handle in _source_handles(log) if handle.get_label() != shown_by_colour]
    finish(figure, directory / "u.png", "Curvature coordinates" + _selection_note(log), components + rest + modes)
    return "u.png", "Curvature coordinates u of every segment, and reference minus u."


def _limit_to_active(axes, log, t, values):
    """The axis of an error fits the tracking; the blend at the start may exceed it."""
    rows = np.isin(np.arange(len(log.t_s)), np.flatnonzero(log.tracking_rows(1.0)))
    rows = rows[:: max(1, len(log.t_s) // len(t))][: len(t)]
    chosen = values[rows]
    chosen = chosen[np.isfinite(chosen)]
    if chosen.size:
        bound = max(1.25 * np.abs(chosen).max(), 0.1)
        axes.set_ylim(-bound, bound)


def velocities(log, directory):
    """Filtered velocity of u."""
    if log.velocity is None:
        return None
    shown = _shown_segments(log)
    figure, grid = _grid(len(shown), 1, row_height=1.55)
    t, velocity = thinned(log.t_s, log.velocity)
    for row, segment in enumerate(shown):
        for k in range(2):
            grid[row][0].plot(t, velocity[:, segment, k], color=COMPONENT[k], linewidth=0.9)
        grid[row][0].set_ylabel(f"$\\dot u_{{{segment + 1}}}$ [rad/s]")
        at_least(grid[row][0], 0.05)
    modes = time_axes(grid, log)
    components = [Line2D([], [], color=COMPONENT[k], label=f"$\\dot u_{axis}$") for k, axis in enumerate("xy")]
    finish(figure, directory / "velocities.png", "Estimated velocity" + _selection_note(log), components + modes)
    return "velocities.png", "Velocity of u as the filter estimates it."


def elongations(log, directory):
    """Elongation of every segment that stretches, and its error."""
    if log.elongation_m is None:
        return None
    shown = _shown_segments(log)
    true_m, reference_m = log.true_elongation_m, log.reference_elongation_m
    error_m = None if true_m is None or reference_m is None else reference_m - true_m
    figure, grid = _grid(len(shown), 2 if error_m is not None else 1, row_height=1.55)
    t, measured_m, true_m, reference_m, error_m = thinned(log.t_s, log.elongation_m, true_m, reference_m, error_m)
    for row, segment in enumerate(shown):
        axes = grid[row][0]
        if true_m is not None:
            axes.plot(t, 1e3 * measured_m[:, segment], **ESTIMATE_STYLE)
        axes.plot(t, 1e3 * (measured_m if true_m is None else true_m)[:, segment], color=INK)
        if reference_m is not None:
            axes.plot(t, 1e3 * reference_m[:, segment], **REFERENCE_STYLE)
        axes.set_ylabel(f"$e_{{{segment + 1}}}$ [mm]")
        at_least(axes, 0.5)
        if error_m is not None:
            axes = grid[row][1]
            axes.plot(t, 1e3 * error_m[:, segment], color=INK, linewidth=0.9)
            axes.set_ylabel("error [mm]")
            at_least(axes, 0.1)
            _limit_to_active(axes, log, t, 1e3 * error_m[:, segment:segment + 1])
    finish(figure, directory / "elongations.png", "Elongation" + _selection_note(log),
           _source_handles(log) + time_axes(grid, log))
    return "elongations.png", "Length of every segment minus its length at rest, and reference minus arm."


def recording(log, directory):
    """u, its velocity and residuals in one picture: for a log without the true state."""
    if _has_truth(log) or log.velocity is None or log.twist_rad is None or log.segments > 1:
        return None
    panels = [("$u$ [rad]", log.u[:, 0]), (r"$\dot u$ [rad/s]", log.velocity[:, 0]),
              ("torsion [mrad]", 1e3 * log.twist_rad), ("chord error [mm]", 1e3 * log.length_m)]
    figure, grid = _grid(len(panels), 1, row_height=1.4)
    for row, (label, values) in zip(grid, panels):
        t, values = thinned(log.t_s, values)
        for k in range(values.shape[1]):
            row[0].plot(t, values[:, k], linewidth=0.9, color=COMPONENT[k] if values.shape[1] == 2 else INK)
        row[0].set_ylabel(label)
    modes = time_axes(grid, log)
    components = [Line2D([], [], color=COMPONENT[k], label=f"${axis}$ component") for k, axis in enumerate("xy")]
    finish(figure, directory / "recording.png", "Estimates from the recording", components + modes)
    return "recording.png", ("Curvature u and its velocity; rotation about the axis that a segment of constant curvature "
                             "does not have; measured minus expected chord.")


def pressures(log, directory):
    """Pressures of every chamber: commanded, and real or measured."""
    shown = [s for s in _shown_segments(log)
             if log.pressures("p", s + 1) is not None or log.pressures("pm", s + 1) is not None]
    if not shown:
        return None
    figure, grid = _grid(len(shown), 1, row_height=1.7)
    chambers, kinds = 0, set()
    for row, segment in enumerate(shown):
        axes = grid[row][0]
        for prefix, style in (("p", {"linewidth": 0.8, "alpha": 0.55}), ("pm", {"linewidth": 1.3})):
            values = log.pressures(prefix, segment + 1)
            if values is None:
                continue
            kinds.add(prefix)
            t, values = thinned(log.t_s, values)
            chambers = max(chambers, values.shape[1])
            for j in range(values.shape[1]):
                axes.plot(t, values[:, j], color=CATEGORY[j % len(CATEGORY)], **style)
        axes.set_ylabel(f"segment {segment + 1} [{'N m' if log.torques else 'bar'}]")
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        at_least(axes, 0.05)
    modes = time_axes(grid, log)
    labels = ["$\\tau_x$", "$\\tau_y$"] if log.torques else [f"chamber {j + 1}" for j in range(min(chambers, 8))]
    handles = [Line2D([], [], color=CATEGORY[j % len(CATEGORY)], label=label) for j, label in enumerate(labels)]
    if kinds == {"p", "pm"}:
        handles += [Line2D([], [], color=INK, linewidth=0.8, alpha=0.55, label="commanded"),
                    Line2D([], [], color=INK, linewidth=1.3, label="behind the valve")]
    title = "Moments" if log.torques else "Chamber pressures"
    finish(figure, directory / "pressures.png", title + _selection_note(log), handles + modes)
    return "pressures.png", "Moments about the local x and y axes." if log.torques else "Chamber pressures above ambient."


def tip_path(log, directory):
    """The tip's path in space, and from above."""
    if log.tip_m is None and log.tip_reference_m is None:
        return None
    figure = plt.figure(figsize=(11, 5.4))
    space = figure.add_subplot(1, 2, 1, projection="3d")
    above = figure.add_subplot(1, 2, 2)
    paths = [(log.tip_m, ARM_STYLE, "tip"), (log.tip_reference_m, REFERENCE_STYLE, "reference")]
    handles, points = [], []
    for path, style, label in paths:
        if path is None:
            continue
        _, path = thinned(log.t_s, path)
        mm = 1e3 * path
        points.append(mm[np.isfinite(mm).all(axis=1)])
        space.plot(mm[:, 0], mm[:, 1], mm[:, 2], **style)
        above.plot(mm[:, 0], mm[:, 1], **style)
        handles.append(Line2D([], [], label=label, **style))
    points = np.concatenate(points)
    start = points[0]
    space.scatter(*start, color=CATEGORY[1], s=22, depthshade=False)
    above.scatter(*start[:2], color=CATEGORY[1], s=26, zorder=3)
    handles.append(Line2D([], [], color=CATEGORY[1], marker="o", linestyle="", markersize=5, label="start"))
    extent = np.ptp(points, axis=0)
    extent = np.maximum(extent, 0.4 * extent.max() + 1e-6)  # one scale on all axes, no flat box
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    for axis, name in enumerate("xyz"):
        getattr(space, f"set_{name}lim")(middle[axis] - 0.55 * extent[axis], middle[axis] + 0.55 * extent[axis])
        getattr(space, f"set_{name}label")(f"{name} [mm]")
        getattr(space, f"{name}axis").set_pane_color((0.965, 0.975, 0.985, 1.0))
    space.set_box_aspect(extent, zoom=1.12)
    space.view_init(elev=24, azim=-58)
    space.locator_params(nbins=5)
    above.set_aspect("equal", adjustable="datalim")
    above.set_xlabel("x [mm]")
    above.set_ylabel("y [mm]")
    above.set_title("from above")
    finish(figure, directory / "tip_path.png", "Path of the tip, world frame", handles)
    return "tip_path.png", "Path of the arm's tip in the world frame."


HISTOGRAM_TITLES = {"lateness_us": "wake-up after the deadline", "frame_age_us": "age of the newest frame",
                    "tick_us": "tick, wake-up to command", "publish_us": "publishing"}


def _finite_edges(edges, buckets):
    """Edges for a logarithmic axis, one more than buckets: an open or zero end gets a separate place."""
    edges = [np.nan if edge is None else float(edge) for edge in edges]
    if len(edges) == buckets:  # lower edges only
        edges.append(np.nan)
    if not np.isfinite(edges[-1]):
        edges[-1] = edges[-2] ** 2 / edges[-3]
    if edges[0] <= 0:
        edges[0] = edges[1] / 2
    return np.array(edges)


def _quantile(edges, counts, q):
    """Upper edge of the bucket that holds the quantile, an upper bound of it."""
    return edges[1:][np.searchsorted(np.cumsum(counts), q * np.sum(counts))]


def _duration(us):
    return f"{us:.3g} µs" if us < 1e3 else f"{us / 1e3:.3g} ms" if us < 1e6 else f"{us / 1e6:.3g} s"


def tick_times(log, directory):
    """Histograms of the tick's times."""
    histograms = {name: h for name, h in log.timing.get("histograms", {}).items() if sum(h.get("counts", [])) > 0}
    if not histograms:
        return None
    columns = min(2, len(histograms))
    rows = -(-len(histograms) // columns)
    figure, grid = plt.subplots(rows, columns, figsize=(11, 0.9 + 2.5 * rows), squeeze=False)
    for axes in grid.flat[len(histograms):]:
        axes.set_visible(False)
    for axes, (name, histogram) in zip(grid.flat, histograms.items()):
        counts = np.array(histogram["counts"], dtype=float)
        edges = _finite_edges(histogram["edges_us"], len(counts))
        filled = np.flatnonzero(counts)
        first, last = max(filled[0] - 1, 0), min(filled[-1] + 2, len(counts))
        axes.bar(edges[first:last], counts[first:last], width=np.diff(edges[first:last + 1]), align="edge",
                 color=CATEGORY[0], edgecolor="white", linewidth=0.6)
        axes.set_xscale("log")
        axes.set_yscale("log")
        decades = np.log10(edges[last] / edges[first])
        axes.xaxis.set_major_locator(LogLocator(subs=(1,) if decades > 2.5 else (1, 2, 5)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda us, _: _duration(us)))
        axes.minorticks_off()
        axes.set_ylim(bottom=0.6)
        known = log.timing.get(name, {})
        for q, key, colour in ((0.5, "p50", CATEGORY[2]), (0.99, "p99", CATEGORY[1])):
            value = known.get(key, _quantile(edges, counts, q))
            axes.axvline(value, color=colour, linewidth=1.2)
            axes.text(value, 0.985, f" {key} {_duration(value)}", color=colour, fontsize=8, va="top",
                      transform=axes.get_xaxis_transform(), ha="left" if q > 0.9 else "right")
        axes.set_xlabel("duration")
        axes.set_ylabel("count")
        largest = f", largest {_duration(known['max'])}" if "max" in known else ""
        axes.set_title(HISTOGRAM_TITLES.get(name, name) + largest)
        axes.set_ylim(top=axes.get_ylim()[1] * 3)
    finish(figure, directory / "tick_times.png", "Timing of a tick", row_gap=0.8)
    return "tick_times.png", "Histograms since start; both axes are logarithmic."


def residuals(log, directory):
    """Residuals of the constant-curvature segment, the age of frames, and the modes."""
    age_s, saturated = log.column("frame_age_s"), log.column("saturated")
    panels = []
    if log.twist_rad is not None:
        panels.append(("torsion [mrad]", 1e3 * log.twist_rad))
    if log.length_m is not None:
        panels.append(("chord error [mm]", 1e3 * log.length_m))
    if age_s is not None:
        panels.append(("frame age [ms]", 1e3 * age_s[:, None]))
    if not panels:
        return None
    figure, axes = plt.subplots(len(panels) + 1, 1, figsize=(11, 1.5 + 1.7 * len(panels)), sharex=True,
                                gridspec_kw={"height_ratios": [1.0] * len(panels) + [0.28]})
    for panel, (label, values) in zip(axes, panels):
        t, values = thinned(log.t_s, values)
        for i in range(values.shape[1]):
            panel.plot(t, values[:, i], linewidth=0.7, color=INK if "age" in label else _segment_colour(i))
        panel.set_ylabel(label)
        if "age" in label:
            panel.set_ylim(bottom=0)
    modes = time_axes(axes[:, None], log)
    lane = axes[-1]
    if saturated is not None:
        t, flag = thinned(log.t_s, saturated)
        lane.fill_between(t, 0, flag, step="post", color=CATEGORY[1], linewidth=0)
    lane.set_ylim(0, 1)
    lane.set_yticks([])
    lane.set_ylabel("saturated", rotation=0, ha="right", va="center")
    handles = [Line2D([], [], color=_segment_colour(i), label=f"segment {i + 1}") for i in range(min(log.segments, 8))]
    finish(figure, directory / "residuals.png", "Residuals and frames", handles + modes, left_margin=0.85)
    return "residuals.png", ("Rotation about the axis that a segment of constant curvature does not have, measured minus "
                             "expected chord, age of the newest frame at the tick, and when a limit cut the command.")


ALL = (*shapes.ALL, figure9, curvature, recording, pressures, tip_path, residuals, velocities, elongations,
       tick_times)
