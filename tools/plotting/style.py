"""Appearance of our plots: one set of colours, fonts and helpers for every figure."""
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Patch

INK = "#1b2733"
REFERENCE = "#1b2733"
ESTIMATE = "#9fb3c8"
COMPONENT = ("#0b6fb8", "#d1571b")  # x, y
CATEGORY = ("#0b6fb8", "#d1571b", "#12876f", "#a3488f", "#c99700", "#4aa3df", "#7a5c3e", "#5b6770")
MODE_COLOUR = {"WAIT_FRAMES": "#c5ced6", "HOLD": "#f6c453", "VENT": "#e98074", "FAULT": "#8e2a2a", "INIT": "#dfe5ea"}
MAX_POINTS = 5000

plt.rcParams.update({
    "figure.facecolor": "white", "savefig.facecolor": "white", "savefig.dpi": 130,
    "font.size": 9, "axes.titlesize": 9.5, "axes.titleweight": "bold", "axes.titlelocation": "left",
    "axes.labelsize": 9, "axes.edgecolor": "#8795a1", "axes.linewidth": 0.8, "axes.spines.top": False,
    "axes.spines.right": False, "axes.grid": True, "axes.axisbelow": True, "grid.color": "#e3e8ed",
    "grid.linewidth": 0.7, "text.color": INK, "axes.labelcolor": INK, "xtick.color": INK, "ytick.color": INK,
    "xtick.labelsize": 8, "ytick.labelsize": 8, "legend.frameon": False, "legend.fontsize": 8.5,
    "lines.linewidth": 1.2, "lines.solid_capstyle": "round", "path.simplify": True,
})


def thinned(t_s, *arrays):
    """Every k-th row, so that no curve has more points than a picture can show."""
    step = max(1, len(t_s) // MAX_POINTS)
    return (t_s[::step], *(None if a is None else a[::step] for a in arrays))


def shade_modes(axes, log):
    """Behind a time axis: every mode but ACTIVE. Returns the names of those shaded."""
    seen = []
    for mode, _, start, end in log.mode_spans():
        if mode in MODE_COLOUR and end > start:
            axes.axvspan(start, end, color=MODE_COLOUR[mode], alpha=0.45, linewidth=0, zorder=0)
            if mode not in seen:
                seen.append(mode)
    return seen


def time_axes(figure_axes, log):
    """Shades the modes, sets the limits, labels the lowest row. Returns legend entries for the modes."""
    grid = np.atleast_2d(figure_axes)
    seen = []
    for axes in grid.flat:
        seen += [mode for mode in shade_modes(axes, log) if mode not in seen]
        axes.set_xlim(log.t_s[0], max(np.ceil(100 * log.t_s[-1]) / 100, log.t_s[0] + 0.01))
        axes.margins(y=0.08)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    return [Patch(color=MODE_COLOUR[mode], alpha=0.45, label=mode, linewidth=0) for mode in seen]


def at_least(axes, span):
    """No axis so narrow that it magnifies round-off; `span` in the axis' unit."""
    low, high = axes.get_ylim()
    if high - low < span:
        middle = (high + low) / 2
        axes.set_ylim(middle - span / 2, middle + span / 2)


def replace(path, write):
    """Lets `write` make the file beside its place and puts it there whole: never through a link, into another file."""
    partial = path.with_name(f".partial.{path.name}")
    partial.unlink(missing_ok=True)
    write(partial)
    os.replace(partial, path)


def finish(figure, path, title, handles=(), row_gap=0.22, left_margin=0.72, column_gap=0.85):
    """Title on the left, legend right of it in the same line, everything in its place (inches), saved."""
    width, height = figure.get_size_inches()
    # Margins and gaps have a fixed size on paper, whatever the figure's; tight_layout would take as long as drawing.
    rows, columns = figure.axes[0].get_subplotspec().get_gridspec().get_geometry()
    titled = any(axes.get_title(loc="left") for axes in figure.axes)
    top, bottom, left, right = 0.72 if titled else 0.55, 0.48, left_margin, 0.15
    row = (height - top - bottom - row_gap * (rows - 1)) / rows
    column = (width - left - right - column_gap * (columns - 1)) / columns
    figure.subplots_adjust(left / width, bottom / height, 1 - right / width, 1 - top / height, column_gap / column,
                           row_gap / row)
    figure.text(0.012, 1 - 0.12 / height, title, fontsize=11.5, fontweight="bold", va="top", ha="left")
    if handles:
        figure.legend(handles=list(handles), loc="upper right", ncol=len(handles), handlelength=1.8,
                      columnspacing=1.4, bbox_to_anchor=(0.995, 1 - 0.03 / height), borderaxespad=0.2)
    replace(path, figure.savefig)
    plt.close(figure)
