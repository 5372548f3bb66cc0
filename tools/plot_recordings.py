#!/usr/bin/python3
"""Plots recordings of real arms beside what was predicted: reads DIR/*.csv of `softarm-dev bench recordings DATA --out DIR`,
writes DIR/recordings.png with u of every segment and the tip across and along the axis."""
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
    half = (len(names) - 1) // 2
    if names[0] != "time_s" or half < 5 or rows.shape[1] != 1 + 2 * half:
        raise ValueError(f"{path}: expected a file that `softarm-dev bench recordings --out` writes")
    return rows[:, 0], rows[:, 1:1 + half], rows[:, 1 + half:]


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def draw_row(axes, path):
    t_s, measured, predicted = read(path)
    dof = measured.shape[1] - 3
    error = measured - predicted
    axes[0].set_title(f"{path.stem.replace('_', ' ')}: {1e3 * rms(error[:, :dof]):.1f} mrad of "
                      f"{1e3 * rms(measured[:, :dof] - measured[:, :dof].mean(0)):.0f}")
    for k in range(dof):
        time, seen, model = style.thinned(t_s, measured[:, k], predicted[:, k])
        axes[0].plot(time, seen, color=style.ESTIMATE, linewidth=2.4)
        axes[0].plot(time, model, color=style.CATEGORY[k % len(style.CATEGORY)])
    tip, model = 1e3 * measured[:, dof:], 1e3 * predicted[:, dof:]
    tip, model = tip - tip.mean(0), model - tip.mean(0)
    axes[1].plot(tip[:, 0], tip[:, 1], color=style.ESTIMATE, linewidth=2.4)
    axes[1].plot(model[:, 0], model[:, 1], color=style.COMPONENT[0])
    axes[1].set_aspect("equal", adjustable="datalim")
    axes[2].plot(t_s, tip[:, 2], color=style.ESTIMATE, linewidth=2.4)
    axes[2].plot(t_s, model[:, 2], color=style.COMPONENT[0])
    axes[0].set_ylabel("u [rad]")
    axes[1].set_ylabel("tip, y [mm]")
    axes[2].set_ylabel("tip along the axis [mm]")


def draw(directory):
    paths = sorted(directory.glob("*.csv"))
    if not paths:
        raise ValueError(f"{directory}: expected files that `softarm-dev bench recordings --out` writes")
    figure, grid = plt.subplots(len(paths), 3, figsize=(14, 1.0 + 2.4 * len(paths)), squeeze=False,
                                gridspec_kw={"width_ratios": (1.5, 0.8, 1.2)})
    for row, path in zip(grid, paths):
        draw_row(row, path)
    grid[-1, 0].set_xlabel("time [s]")
    grid[-1, 1].set_xlabel("tip, x [mm]")
    grid[-1, 2].set_xlabel("time [s]")
    handles = [Line2D([], [], color=style.ESTIMATE, linewidth=2.4, label="measured"),
               Line2D([], [], color=style.COMPONENT[0], label="predicted from pressures, not seen before")]
    path = directory / "recordings.png"
    style.finish(figure, path, "Recordings of real arms", handles)
    return str(path)


sys.exit(plot_folder(draw, __doc__, "folder of the files"))
