"""Costs of the Python package beside C++ and SoRoMoX; started by `softarm-dev bench python`.

usage: python_bench.py CONFIG SECONDS JSON_OF_C++_TIMES [PYTHON_WITH_SOROMOX]
Every round times each side for some milliseconds, so that what else the machine does meets all of them; medians of
processor time, but for the simulated arms on one and two threads, whose time is the clock's: measure those on a quiet machine.
"""

import json
import pathlib
import statistics
import subprocess
import sys
import time

import numpy as np

SEGMENTS = 3
LENGTH_M, MASS_KG, STIFFNESS, DAMPING = 0.11, 0.15, 0.626, 0.029
PLANTS = 16


class Soromox:
    """The same arm there, in a separate Python: the spatial PCS model with bending alone."""

    def __init__(self, python):
        self._worker = subprocess.Popen(
            [python, __file__, "--soromox"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )
        self.version = self._worker.stdout.readline().strip()

    def ask(self, u, velocity, calls):
        """u'', and the processor time of a call in us, of all threads, and the clock's of the quickest."""
        self._worker.stdin.write(json.dumps([u.tolist(), velocity.tolist(), calls]) + "\n")
        answer = json.loads(self._worker.stdout.readline())
        return np.array(answer["acceleration"]), answer["us"], answer["wall_us"]

    def close(self):
        self._worker.stdin.close()
        self._worker.wait()


def serve_soromox():
    import importlib.metadata
    import os

    os.environ["JAX_PLATFORMS"] = "cpu"
    import jax

    jax.config.update("jax_enable_x64", True)
    import jax.numpy as jnp
    from soromox.systems.components import LinkSpec
    from soromox.systems.pcs.pcs import PCS
    from soromox.systems.pcs.structures import PCSStructure

    # Curvature = theta / L, about Y and Z with X along the arm; a radius of which the rotary inertia is nothing.
    radius = 1e-4
    stiffness, damping = np.eye(6), np.zeros((6, 6))
    for axis in (1, 2):
        stiffness[axis, axis], damping[axis, axis] = STIFFNESS * LENGTH_M**2, DAMPING * LENGTH_M**2
    link = LinkSpec.circular(
        length=LENGTH_M,
        density=MASS_KG / (np.pi * radius**2 * LENGTH_M),
        radius=radius,
        reference_strain=[0, 0, 0, 1, 0, 0],
        stiffness=jnp.asarray(stiffness),
        damping=jnp.asarray(damping),
    )
    arm = PCS.from_links(
        [link] * SEGMENTS,
        structure=PCSStructure(strain_selector=[False, True, True, False, False, False] * SEGMENTS),
        gravity=jnp.array([9.81, 0.0, 0.0]),
        base_pose=jnp.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        backend="jax",
    )
    forward = jax.jit(lambda state: arm.forward_dynamics(0.0, state))

    def curvature(u):
        return np.column_stack([-u[1::2], u[::2]]).ravel() / LENGTH_M

    state = jnp.zeros(4 * SEGMENTS)
    forward(state).block_until_ready()
    print(f"soromox {importlib.metadata.version('soromox')}, jax {jax.__version__}", flush=True)
    for line in sys.stdin:
        u, velocity, calls = json.loads(line)
        state = jnp.concatenate([jnp.asarray(curvature(np.array(u))), jnp.asarray(curvature(np.array(velocity)))])
        begin, best_s = time.process_time(), float("inf")
        for _ in range(calls):
            called = time.perf_counter()
            out = forward(state).block_until_ready()
            best_s = min(best_s, time.perf_counter() - called)
        us = 1e6 * (time.process_time() - begin) / calls
        bent = np.asarray(out)[2 * SEGMENTS :] * LENGTH_M
        print(json.dumps({"acceleration": np.column_stack([bent[1::2], -bent[::2]]).ravel().tolist(), "us": us, "wall_us": 1e6 * best_s}), flush=True)


def timed_us(call, calls, clock=time.process_time):
    begin = clock()
    for _ in range(calls):
        call()
    return 1e6 * (clock() - begin) / calls


def tick_us(softarm, experiment, ticks):
    """Median time of the daemon's tick called from Python, in lock step with the simulated arm."""
    pipeline, arm = softarm.ControlPipeline(experiment), softarm.SimulatedArm(experiment)
    times = []
    for k in range(ticks):
        now_ns = k * pipeline.period_ns
        arm.advance_to(now_ns)
        frames, measured = arm.receive(), arm.plant.pressure_bar.astype(np.float32)
        begin = time.process_time_ns()
        tick = pipeline.tick(now_ns, frames, measured_bar=measured, go=True)
        times.append(1e-3 * (time.process_time_ns() - begin))
        arm.command(tick.pressure_bar, 0.1, now_ns)
    assert tick.mode == "ACTIVE", tick.mode
    return statistics.median(times)


def measure(config, seconds, cpp, soromox_python):
    import softarm

    experiment = softarm.load_experiment(config)
    arm = softarm.Arm(
        length_m=[LENGTH_M] * SEGMENTS,
        mass_kg=[MASS_KG] * SEGMENTS,
        stiffness_nm_per_rad=[STIFFNESS] * SEGMENTS,
        damping_nms_per_rad=[DAMPING] * SEGMENTS,
    )
    random = np.random.default_rng(1)
    u, velocity, force = 0.4 * random.normal(size=arm.dof), random.normal(size=arm.dof), np.zeros(arm.dof)
    controller, state = softarm.Controller(experiment), np.full(2 * experiment.segments, 0.2)
    plants = [softarm.Plant(experiment) for _ in range(PLANTS)]
    commands = random.uniform(0.0, 0.5, (PLANTS, experiment.chambers[0] * experiment.segments))
    soromox = Soromox(soromox_python) if soromox_python else None
    names = "controller", "forward", "derivatives", "soromox", "soromox wall", "forward wall", "one thread", "two threads"
    rows = {name: [] for name in names}
    report = {}
    if soromox:
        theirs, *_ = soromox.ask(u, velocity, 1)
        ours = arm.forward_dynamics(u, velocity, force)
        report["soromox"] = soromox.version
        report["difference"] = float(np.abs(theirs - ours).max() / np.abs(ours).max())
    end = time.monotonic() + seconds
    while time.monotonic() < end or len(rows["controller"]) < 5:
        rows["controller"].append(timed_us(lambda: controller.compute(state, state, state, state, state), 500))
        rows["forward"].append(timed_us(lambda: arm.forward_dynamics(u, velocity, force), 500))
        rows["derivatives"].append(timed_us(lambda: arm.forward_dynamics_derivatives(u, velocity, force), 200))
        if soromox:
            _, processor_us, wall_us = soromox.ask(u, velocity, 50)
            rows["soromox"].append(processor_us)
            rows["soromox wall"].append(wall_us)
            rows["forward wall"].append(timed_us(lambda: arm.forward_dynamics(u, velocity, force), 20, time.perf_counter))
        for name, threads in (("one thread", 1), ("two threads", 2)):
            rows[name].append(timed_us(lambda: softarm.advance(plants, 0.2, commands, threads=threads), 1, time.perf_counter))
    if soromox:
        soromox.close()

    def median_ratio(above, below):
        return statistics.median(a / b for a, b in zip(rows[above], rows[below]))

    report |= {
        "controller_us": statistics.median(rows["controller"]),
        "controller_cpp_us": cpp["controller_us"],
        "tick_us": tick_us(softarm, experiment, 2000),
        "tick_cpp_us": cpp["tick_us"],
        "forward_us": statistics.median(rows["forward"]),
        "forward_cpp_us": cpp["forward_us"],
        "derivatives_us": statistics.median(rows["derivatives"]),
        "derivatives_cpp_us": cpp["derivatives_us"],
        "two_threads_over_one": median_ratio("one thread", "two threads"),
        "derivatives": cpp["derivatives"],
    }
    if soromox:
        report["soromox_us"] = statistics.median(rows["soromox"])
        report["soromox_over_forward"] = median_ratio("soromox", "forward")
        report["soromox_over_forward_best_wall"] = min(rows["soromox wall"]) / min(rows["forward wall"])
    return report


def table(r):
    lines = ["                                    Python [us]   C++ [us]"]
    for text, name in (
        ("controller (17)", "controller"),
        ("the daemon's tick", "tick"),
        ("forward dynamics", "forward"),
        ("with its derivatives", "derivatives"),
    ):
        lines.append(f"{text:36}{r[name + '_us']:11.2f}{r[name + '_cpp_us']:11.2f}")
    if "soromox" in r:
        lines.append(
            f"forward dynamics of {r['soromox']}: {r['soromox_us']:.1f} us, {r['soromox_over_forward']:.0f} times ours"
            f" ({r['soromox_over_forward_best_wall']:.0f} times by the clock, the quickest calls of each);"
            f" the same arm to {r['difference']:.1e}"
        )
    lines.append("times one evaluation, in C++            segments: " + "".join(f"{row['segments']:6}" for row in r["derivatives"][:4]))
    for text, ratio in (("forward dynamics and its derivatives", "forward_ratio"), ("static stiffness over static moments", "static_ratio")):
        for kind, rows in (("", r["derivatives"][:4]), (", stretching", r["derivatives"][4:])):
            lines.append(f"{text + kind:50}" + "".join(f"{row[ratio]:6.1f}" for row in rows))
    lines.append(f"{PLANTS} simulated arms, two threads over one: {r['two_threads_over_one']:.2f}")
    return "\n".join(lines)


if __name__ == "__main__":
    if sys.argv[1] == "--soromox":
        serve_soromox()
    else:
        config, seconds, cpp, as_json, *soromox = sys.argv[1:]
        found = measure(pathlib.Path(config), float(seconds), json.loads(cpp), soromox[0] if soromox else None)
        print(json.dumps(found) if as_json == "json" else table(found))
