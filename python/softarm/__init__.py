"""Model, control and simulation of multi-segment soft continuum arms.

    import softarm
    experiment = softarm.load_experiment("config/paper_arm.yaml")
    arm = softarm.Arm(experiment)                       # the model: arrays in, arrays out
    B, C, G = arm.dynamics_matrices(u, velocity)
    log = softarm.run(experiment, duration_s=5.0)       # pipeline and simulated arm in lock step

The state is u = theta [cos phi, sin phi] of every segment: shape (2n,), rad.
"""

import numpy as _numpy

from softarm._build import PYBIND11_VERSION as _pybind11

if int(_numpy.__version__.split(".")[0]) >= 2 and _pybind11 < (2, 12):
    raise ImportError(
        f"this build of softarm (pybind11 {'.'.join(map(str, _pybind11))}) needs numpy < 2, found {_numpy.__version__}:"
        " install numpy<2, or the package by `pip install ./python`, which builds with a newer pybind11"
    )

from softarm._core import (
    Allocator,
    Arm,
    ArmClient,
    ControlPipeline,
    Controller,
    Experiment,
    Frame,
    LawState,
    Plant,
    PlantError,
    PlantState,
    SimulatedArm,
    Status,
    Tick,
    TransportError,
    __version__,
    advance,
    load_experiment,
    polar_to_u,
    run,
    u_to_polar,
)
from softarm.errors import ConfigError

__all__ = [
    "Allocator",
    "Arm",
    "ArmClient",
    "ConfigError",
    "ControlPipeline",
    "Controller",
    "Experiment",
    "Frame",
    "LawState",
    "Plant",
    "PlantError",
    "PlantState",
    "SimulatedArm",
    "Status",
    "Tick",
    "TransportError",
    "__version__",
    "advance",
    "load_experiment",
    "polar_to_u",
    "run",
    "u_to_polar",
]
