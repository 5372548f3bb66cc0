"""gymnasium's own check of the environment, and that a law reaches its target in it."""

import os
import pathlib
import sys

ENVIRONMENT = pathlib.Path(__file__).resolve().parents[2] / "build/python/bin/python"
if not ENVIRONMENT.exists():
    print("skipped: tools/python_environment was not run")
    sys.exit(77)
if sys.prefix != str(ENVIRONMENT.parents[1]):
    os.execv(ENVIRONMENT, [ENVIRONMENT, *sys.argv])

import gymnasium.utils.env_checker as env_checker
import numpy as np
import softarm
import softarm.gym

PAPER_ARM = pathlib.Path(__file__).resolve().parents[2] / "config/paper_arm.yaml"

STRETCHING = PAPER_ARM.with_name("paper_arm_stretching.yaml")

for file in (PAPER_ARM, STRETCHING):
    env_checker.check_env(softarm.gym.ReachEnv(file))

env = softarm.gym.ReachEnv(PAPER_ARM, episode_s=12.0)  # the open-loop arm takes that long to come to rest
arm, allocator = softarm.Arm(softarm.load_experiment(PAPER_ARM)), softarm.Allocator(softarm.load_experiment(PAPER_ARM))
u = np.array([0.5, 0.0, 0.2, -0.3, 0.1, 0.1])
env.reset(seed=1, options={"target_m": arm.tip(u)})
pressures, _ = allocator.allocate(np.linalg.solve(arm.actuation_matrix(u), arm.static_moments(u)))
low, high = softarm.load_experiment(PAPER_ARM).pressure_limits_bar
truncated = terminated = False
while not truncated:
    *_, terminated, truncated, info = env.step(2.0 * (pressures - low) / (high - low) - 1.0)
    assert not terminated
assert info["distance_m"] < 1e-4, info
print(f"within {1000 * info['distance_m']:.4f} mm of the target")
