"""Simulated arms as gymnasium environments; needs the package gymnasium.

    env = softarm.gym.ReachEnv("config/paper_arm.yaml")
"""

import gymnasium
import numpy as np

import softarm


class ReachEnv(gymnasium.Env):
    """Bring the tip of the experiment's simulated arm to a point.

    Action: pressures, (chambers,), each from -1 (the lowest the experiment allows) to 1 (the highest).
    Observation: u (rad), u' (rad/s), where segments stretch e (m) and e' (m/s), pressures (bar), tip and target (m,
    world), one after the other.
    Reward: minus the distance from tip to target in m, times the time of a step in s.
    An episode ends, terminated, where a segment bends by more than the experiment's control.max_theta_rad
    or the integrator fails, and truncated after episode_s. A target is the tip of a shape at rest under
    random pressures, so it can be reached.
    """

    metadata = {"render_modes": []}

    def __init__(self, experiment, step_s=0.02, episode_s=4.0):
        """experiment: a file or a softarm.Experiment; step_s: time for which an action is held."""
        if not isinstance(experiment, softarm.Experiment):
            experiment = softarm.load_experiment(experiment)
        if not 0.0 < step_s <= episode_s:
            raise ValueError("step_s, episode_s: expected 0 < step_s <= episode_s")
        self._arm = softarm.Arm(experiment)
        self._allocator = softarm.Allocator(experiment)
        self._experiment = experiment
        self._plant = softarm.Plant(experiment)
        self._start_u = self._plant.u
        self._lowest, self._highest = experiment.pressure_limits_bar
        self._max_theta = experiment.max_theta_rad
        self._step_s = step_s
        self._steps_an_episode = round(episode_s / step_s)
        self._target = np.zeros(3)
        self._steps = 0
        size = 2 * self._arm.dof + self._plant.chambers + 6
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (self._plant.chambers,), np.float32)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float64)

    def _pressures(self, action):
        share = (np.clip(np.asarray(action, dtype=float), -1.0, 1.0) + 1.0) / 2.0
        return self._lowest + share * (self._highest - self._lowest)

    def _observation(self):
        plant = self._plant
        return np.concatenate(
            [plant.u, plant.velocity, plant.elongation_m, plant.elongation_rate_mps, plant.pressure_bar, plant.tip_m, self._target]
        )

    def _random_target(self):
        while True:
            pressures = self._pressures(self.np_random.uniform(-1.0, 1.0, self._plant.chambers))
            # Where A_chamber is constant, the moments of the pressures do not depend on the shape.
            force = self._allocator.generalized_force(pressures)
            moments = np.linalg.solve(self._arm.actuation_matrix(np.zeros(self._arm.dof)), force)
            u = self._arm.rest_shape(moments)
            width = self._arm.dof // self._arm.segments
            if u is not None and np.all(np.hypot(u[0::width], u[1::width]) < self._max_theta):
                return self._arm.tip(u)

    def reset(self, *, seed=None, options=None):
        """Back to rest without pressure, with another target. options: {"target_m": (3,)} to choose it."""
        super().reset(seed=seed)
        zero = np.zeros(self._plant.chambers)
        self._plant = softarm.Plant(self._experiment)  # an integrator that goes on would not repeat its bits
        self._plant.reset(self._start_u, np.zeros(self._start_u.size), np.clip(zero, self._lowest, self._highest))
        self._steps = 0
        chosen = (options or {}).get("target_m")
        self._target = self._random_target() if chosen is None else np.array(chosen, dtype=float).reshape(3)
        return self._observation(), {}

    def step(self, action):
        """Hold the pressures of `action` for step_s."""
        terminated = False
        try:
            self._plant.advance(self._step_s, self._pressures(action))
        except softarm.PlantError:
            terminated = True
        u = self._plant.u
        terminated |= bool(np.any(np.hypot(u[0::2], u[1::2]) > self._max_theta))
        self._steps += 1
        distance = float(np.linalg.norm(self._plant.tip_m - self._target))
        truncated = self._steps >= self._steps_an_episode
        return self._observation(), -distance * self._step_s, terminated, truncated, {"distance_m": distance}
