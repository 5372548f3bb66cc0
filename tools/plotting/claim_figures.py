"""The figures of tools/claims: the claims, the stability maps, control rate and terms. Each takes the results and a path."""
import numpy as np
from matplotlib.lines import Line2D

from .style import CATEGORY, INK, finish, plt

THEORY_STYLE = {"color": INK, "linestyle": (0, (4, 2)), "linewidth": 1.0}
LAW_COLOUR = {"(17)": CATEGORY[0], "statics and PI": CATEGORY[4], "PI alone": CATEGORY[1],
              "(17) and K_I 1": CATEGORY[3], "K_P and K_D alone": CATEGORY[1]}


def _kept(rows, key="u_rms_rad"):
    """Values in mrad; runs that left ACTIVE do not count."""
    return [1e3 * row[key] if row["stayed_active"] and row[key] is not None else np.nan for row in rows]


def _softness(axes, rows):
    passive = rows[0]
    for law in ("(17)", "K_P and K_D alone"):
        mine = [row for row in rows if row["law"] == law]
        gains = [row["kp_nm_per_rad"] for row in mine]
        axes.plot(gains, [row["predicted_n_per_m"] for row in mine], **THEORY_STYLE)
        axes.plot(gains, [row["simulated_n_per_m"] for row in mine], "o", markersize=4.5, color=LAW_COLOUR[law])
    axes.axhline(passive["simulated_n_per_m"], color=CATEGORY[2])
    axes.set_xscale("symlog", linthresh=0.25)
    axes.set_xticks([0, 0.25, 0.5, 1, 2, 4, 8, 16], ["0", "¼", "½", "1", "2", "4", "8", "16"])
    axes.set_yscale("log")
    axes.set_xlim(-0.05, 18)
    axes.minorticks_off()
    axes.set_xlabel("$K_P$ [N m/rad]")
    axes.set_ylabel("tip stiffness [N/m]")
    axes.set_title("stiffness of the tip")
    axes.legend(handles=[Line2D([], [], label="predicted", **THEORY_STYLE),
                         Line2D([], [], color=CATEGORY[0], marker="o", linestyle="", label="(17)"),
                         Line2D([], [], color=CATEGORY[1], marker="o", linestyle="", label="$K_P$ alone"),
                         Line2D([], [], color=CATEGORY[2], label="passive")])


def _speed(axes, rows):
    for law in dict.fromkeys(row["law"] for row in rows):
        mine = [row for row in rows if row["law"] == law]
        name, off, _ = law.partition(", 5 % off")
        axes.plot([row["rate_radps"] for row in mine], _kept(mine), "o:" if off else "o-", markersize=4,
                  color=LAW_COLOUR[name], label=None if off and name != "(17) and K_I 1" else name)
    axes.set_yscale("log")
    axes.set_ylim(bottom=1)
    axes.set_xlabel("rate of (24) [rad/s]")
    axes.set_ylabel("tracking error [mrad rms]")
    axes.set_title("a dynamic model is needed (dotted: parameters 5 % off)")
    axes.legend(loc="upper left", ncol=2, bbox_to_anchor=(0, 1.02))
    axes.set_ylim(top=1000)


def _defect(axes, rows):
    for integral, style in ((False, "-"), (True, ":")):
        mine = [row for row in rows if row["integral"] == integral]
        for segment in range(3):
            values = [1e3 * row["u_rms_segment_rad"][segment] for row in mine]
            axes.plot([100 * row["factor"] for row in mine], values, "o" + style, markersize=4, color=CATEGORY[segment])
    axes.invert_xaxis()
    axes.set_yscale("log")
    axes.set_xlabel("moment of the third segment's chambers [% of expected]")
    axes.set_ylabel("tracking error [mrad rms]")
    axes.set_title("a defect in the third segment")
    axes.legend(handles=[Line2D([], [], color=CATEGORY[i], label=f"segment {i + 1}") for i in range(3)]
                + [Line2D([], [], color=INK, linestyle=":", label="with $K_I$")])


def _tilt(axes, rows):
    for integral, style in ((False, "-"), (True, ":")):
        mine = [row for row in rows if row["integral"] == integral]
        axes.plot([row["degrees"] for row in mine], _kept(mine), "o" + style, markersize=4, color=CATEGORY[0],
                  label="with $K_I$" if integral else "(17)")
    axes.set_xlabel("tilt of the base [degrees]")
    axes.set_ylabel("tracking error [mrad rms]")
    axes.set_ylim(bottom=0)
    axes.set_title("a base that is tilted against the model")
    axes.legend()


def claims(results, path):
    figure, grid = plt.subplots(2, 2, figsize=(11, 7.4))
    _softness(grid[0][0], results["softness"]["rows"])
    _speed(grid[0][1], results["speed"])
    _defect(grid[1][0], results["defect"])
    _tilt(grid[1][1], results["tilt"])
    finish(figure, path, "The paper's claims on a simulated arm", row_gap=0.85)


def stability(results, path):
    maps = results["stability"]["maps"]
    figure, grid = plt.subplots(1, len(maps), figsize=(11, 4.6), squeeze=False)
    for axes, each in zip(grid[0], maps):
        values, gains = 1e3 * np.array(each["values"]), np.array(each["kp_nm_per_rad"])
        growth = np.array([[np.inf if cell is None else cell for cell in column] for column in each["growth_1ps"]])
        stable = np.array(each["stable"])
        x, y = np.meshgrid(values, gains, indexing="ij")
        axes.scatter(x[stable], y[stable], s=12 + 3 * np.clip(-growth[stable], 0, 12), color=CATEGORY[2], linewidth=0)
        axes.scatter(x[~stable], y[~stable], s=20, marker="x", color=CATEGORY[1], linewidth=1)
        axes.plot(values, each["simulated_limit_nm_per_rad"], color=CATEGORY[0], linewidth=1.6)
        axes.plot(values, each["predicted_limit_nm_per_rad"], **THEORY_STYLE)
        axes.set_ylim(0, 1.15 * gains[-1])
        axes.set_xlabel(each["axis"].replace("[s]", "[ms]"))
        axes.set_ylabel("$K_P$ [N m/rad]")
    handles = [Line2D([], [], color=CATEGORY[2], marker="o", linestyle="", markersize=5, label="a blow decays"),
               Line2D([], [], color=CATEGORY[1], marker="x", linestyle="", markersize=5, label="it does not"),
               Line2D([], [], color=CATEGORY[0], linewidth=1.6, label="limit, simulated"),
               Line2D([], [], label="predicted, as by softarm check", **THEORY_STYLE)]
    finish(figure, path, "Stability", handles)


def control(results, path):
    scenes = results["control"]["scenes"]
    figure, grid = plt.subplots(2, len(scenes), figsize=(11, 6.8), squeeze=False)
    for column, scene in enumerate(scenes):
        key, unit = ("tip_rms_m", "tip error [mm rms]") if scene["follows_tip"] else ("u_rms_rad", "error of u [mrad rms]")
        above, below = grid[0][column], grid[1][column]
        rates, errors = [row["rate_hz"] for row in scene["rates"]], _kept(scene["rates"], key)
        above.semilogx(rates, errors, "o-", color=CATEGORY[0])
        above.set_ylim(0, 1.1 * np.nanmax(errors))
        above.set_xticks(rates, [f"{rate:g}" for rate in rates])
        above.minorticks_off()
        for rate, error in zip(rates, errors):
            if not np.isfinite(error):
                above.plot(rate, 0.1 * np.nanmax(errors), "x", color=CATEGORY[1])
                above.annotate("left ACTIVE", (rate, 0.1 * np.nanmax(errors)), (6, -3), textcoords="offset points")
        above.set_xlabel("control rate [Hz]")
        above.set_ylabel(unit)
        above.set_title(scene["name"])
        names = [row["what"] for row in scene["terms"]]
        below.set_xscale("log")
        left = 0.5 * np.nanmin(_kept(scene["terms"], key))
        below.barh(names, _kept(scene["terms"], key), color=CATEGORY[0])
        for row, (entry, value) in enumerate(zip(scene["terms"], _kept(scene["terms"], key))):
            text = f" {entry['controller_ns']:.0f} ns" + ("" if np.isfinite(value) else ", left ACTIVE")
            below.text(value if np.isfinite(value) else left, row, text, va="center", fontsize=8)
        below.set_xlim(left, 8 * below.get_xlim()[1])
        below.invert_yaxis()
        below.set_xlabel(unit)
    finish(figure, path, "Control rate and terms of (17)", row_gap=0.7, left_margin=1.35, column_gap=1.5)


METHOD_STYLE = {"sdirk2": (CATEGORY[0], "o-"), "cash4": (CATEGORY[2], "s-"), "sdirk4": (CATEGORY[3], "^-"),
                "erk": (CATEGORY[4], "v-"), "cvode_bdf": (CATEGORY[1], "o--")}
DEFAULT_STYLE = {"color": CATEGORY[0], "marker": "D", "markersize": 6, "linestyle": ""}
PLAIN_STYLE = {"color": INK, "marker": "*", "markersize": 9, "linestyle": ""}  # the usual set-up


def plants(results, path):
    """Work and precision: real-time factor over error, a curve a method, a point a tolerance."""
    trials = [trial for trial in results["plant"]["trials"] if trial["error_rad"] and trial["real_time_factor"]]
    names, scenes = (list(dict.fromkeys(trial[key] for trial in trials)) for key in ("plant", "scene"))
    figure, grid = plt.subplots(len(scenes), len(names), figsize=(12, 8), squeeze=False)
    for row, scene in enumerate(scenes):
        for column, name in enumerate(names):
            axes = grid[row][column]
            here = [trial for trial in trials if (trial["plant"], trial["scene"]) == (name, scene)]
            for method, (colour, style) in METHOD_STYLE.items():
                points = [trial for trial in here if trial["method"] == method]
                axes.plot([trial["error_rad"] for trial in points], [trial["real_time_factor"] for trial in points], style,
                          color=colour, markersize=3.5, linewidth=1)
            for method, style in (("default", DEFAULT_STYLE), ("cvode plain", PLAIN_STYLE)):
                points = [trial for trial in here if trial["method"].startswith(method)]
                axes.plot([trial["error_rad"] for trial in points], [trial["real_time_factor"] for trial in points], **style)
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.minorticks_off()
            axes.set_title(f"{name}, {scene}")
            if column == 0:
                axes.set_ylabel("times real time")
            if row == len(scenes) - 1:
                axes.set_xlabel("largest error [rad]")
    handles = [Line2D([], [], color=colour, marker=style[0], linestyle=style[1:], markersize=3.5, label=method)
               for method, (colour, style) in METHOD_STYLE.items()]
    handles += [Line2D([], [], label="the default", **DEFAULT_STYLE), Line2D([], [], label="plain CVODE", **PLAIN_STYLE)]
    finish(figure, path, "Simulated arms: speed over error", handles, row_gap=0.5)


def draw_all(results, folder):
    """Draws every figure into the folder and returns their paths."""
    paths = []
    for draw in (claims, stability, control, plants):
        path = folder / f"{draw.__name__}.png"
        draw(results, path)
        paths.append(path)
    return paths
