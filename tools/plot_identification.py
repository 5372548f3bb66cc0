#!/usr/bin/python3
"""Plots an identification: reads DIR/identification.csv of `softarm identify --out DIR`, writes DIR/identification.png with
measured and simulated u of every segment, the residual, and its correlation in time."""
import csv
import sys

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from plotting import style
from plotting.command_line import plot_folder


def read(path):
    with path.open(encoding="utf-8") as file:
        names = next(csv.reader(file))
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    dof = (len(names) - 1) // 2
    if names[0] != "time_s" or dof < 2 or rows.shape[0] < 3 or rows.shape[1] != 1 + 2 * dof:
        raise ValueError(f"{path}: expected the file that `softarm identify --out` writes")
    return rows[:, 0], rows[:, 1:1 + dof], rows[:, 1 + dof:]


def autocorrelation(x, count):
    x = x - x.mean()
    squared = float(x @ x) or 1.0
    return np.array([float(x[: len(x) - k] @ x[k:]) / squared for k in range(count)])


def draw(directory):
    t_s, measured, simulated = read(directory / "identification.csv")
    segments = measured.shape[1] // 2
    residual = measured - simulated
    period_s = float(np.median(np.diff(t_s)))
    lags = min(len(t_s) // 2, 200)
    figure, grid = plt.subplots(segments, 3, figsize=(14, 1.2 + 2.2 * segments), squeeze=False,
                                gridspec_kw={"width_ratios": (1.3, 1.3, 0.8)})
    for i in range(segments):
        for axis in range(2):
            k, colour = 2 * i + axis, style.COMPONENT[axis]
            time, seen, predicted, left = style.thinned(t_s, measured[:, k], simulated[:, k], residual[:, k])
            grid[i, 0].plot(time, seen, color=style.ESTIMATE, linewidth=2.4)
            grid[i, 0].plot(time, predicted, color=colour)
            grid[i, 1].plot(time, 1e3 * left, color=colour, linewidth=0.8)
            grid[i, 2].plot(1e3 * period_s * np.arange(lags), autocorrelation(residual[:, k], lags), color=colour)
        grid[i, 0].set_ylabel(f"u of segment {i + 1} [rad]")
        grid[i, 1].set_ylabel("residual [mrad]")
        grid[i, 2].set_ylabel("autocorrelation")
    grid[-1, 0].set_xlabel("time [s]")
    grid[-1, 1].set_xlabel("time [s]")
    grid[-1, 2].set_xlabel("lag [ms]")
    rms = 1e3 * np.sqrt(np.mean(residual**2))
    handles = [Line2D([], [], color=style.ESTIMATE, linewidth=2.4, label="measured"),
               Line2D([], [], color=style.COMPONENT[0], label="simulated, x"),
               Line2D([], [], color=style.COMPONENT[1], label="simulated, y")]
    path = directory / "identification.png"
    style.finish(figure, path, f"Identification: residual {rms:.3g} mrad rms a component", handles)
    return f"{path}: residual {rms:.3g} mrad rms a component"


sys.exit(plot_folder(draw, __doc__, "folder of identification.csv"))
