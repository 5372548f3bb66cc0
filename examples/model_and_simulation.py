"""The model, the simulated arm and the control loop from Python. usage: model_and_simulation.py CONFIG"""

import sys

import numpy as np
import softarm

experiment = softarm.load_experiment(sys.argv[1])

# The model: arrays in, arrays out. u = theta [cos phi, sin phi] of every segment, rad.
arm = softarm.Arm(experiment)
u = np.tile([0.4, 0.1], experiment.segments)
B, C, G = arm.dynamics_matrices(u, np.zeros(arm.dof))
print("tip in m:", arm.tip(u).round(4))

# Statics: the pressures that hold this shape, and the simulated arm that takes it.
moments = np.linalg.solve(arm.actuation_matrix(u), arm.static_moments(u))
pressures, reachable = softarm.Allocator(experiment).allocate(moments)
plant = softarm.Plant(experiment)
plant.advance(12.0, pressures)  # s
print(f"simulated arm at rest: {1000 * np.abs(plant.u - u).max():.3f} mrad from that shape")

# Control: the daemon's tick and the simulated arm in lock step.
log = softarm.run(experiment, duration_s=5.0)
late = (log["mode"] == "ACTIVE") & (log["t_s"] > 2.0)
error = (log["u_ref"] - log["u_true"])[late]
print(f"tracking error: {1000 * np.sqrt(np.mean(error**2)):.2f} mrad rms")
