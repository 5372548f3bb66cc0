"""The Python package against golden values, laws, the programs and itself. usage: package_test.py BIN_DIR"""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import softarm

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAPER_ARM = ROOT / "config/paper_arm.yaml"
BIN = pathlib.Path(sys.argv.pop()) if len(sys.argv) > 1 else None


def golden_arm(config):
    return softarm.Arm(
        length_m=config["L"],
        mass_kg=config["mu"],
        stiffness_nm_per_rad=config["k"],
        damping_nms_per_rad=config["beta"],
        mass="point",
        base_rotation=config["base_rotation"],
        base_position_m=config["base_position"],
        gravity_mps2=config["gravity"],
    )


class Model(unittest.TestCase):
    def test_golden_values(self):
        """The tolerances of the file's conventions."""
        cases = json.loads((ROOT / "tests/golden/golden.json").read_text())["cases"]
        cases = [case for case in cases if case["config"]["coords"] == "cartesian_u"]
        self.assertGreater(len(cases), 20)
        for case in cases:
            with self.subTest(case["id"]):
                arm, expected = golden_arm(case["config"]), case["expected"]
                u, velocity = np.array(case["q"]), np.array(case["qd"])
                B, C, G = arm.dynamics_matrices(u, velocity)
                scale = np.sqrt(np.diag(expected["B"]))
                self.assertLess(np.max(np.abs(B - expected["B"]) / np.outer(scale, scale)), 1e-12)
                largest = np.max(np.abs(velocity), initial=0.0)
                roundoff = 1e-13 * np.max(scale**2) * largest
                self.assertLess(np.max(np.abs(C - expected["C"])), 1e-12 * np.max(np.abs(expected["C"])) + roundoff + 1e-300)
                self.assertLess(np.max(np.abs(G - expected["G"])), 1e-12 * np.max(np.abs(expected["G"])) + 1e-300 + 1e-15)
                np.testing.assert_allclose(arm.segment_poses(u), expected["T_world"], rtol=0, atol=1e-13)
                np.testing.assert_allclose(arm.mass_centres(u), expected["com_world"], rtol=0, atol=1e-13)
                np.testing.assert_allclose(arm.tip_jacobian(u), expected["J_tip"], rtol=0, atol=1e-13)
                np.testing.assert_allclose(arm.actuation_matrix(u), expected["A_chamber"], rtol=0, atol=1e-13)

    def test_forward_is_the_inverse_of_inverse_dynamics(self):
        arm = softarm.Arm(softarm.load_experiment(PAPER_ARM))
        random = np.random.default_rng(1)
        for _ in range(20):
            u, velocity, acceleration = random.normal(size=(3, arm.dof))
            force = arm.inverse_dynamics(u, velocity, acceleration)
            np.testing.assert_allclose(arm.forward_dynamics(u, velocity, force), acceleration, atol=1e-9)
            np.testing.assert_allclose(arm.static_moments(u), arm.inverse_dynamics(u, 0 * u, 0 * u), atol=1e-13)

    def test_rows_lists_and_keywords_are_one_call(self):
        """Plain rows take a shorter way into C++."""
        arm = softarm.Arm(softarm.load_experiment(PAPER_ARM))
        u, velocity, force = np.random.default_rng(7).normal(size=(3, arm.dof))
        for method, name in ((arm.forward_dynamics, "generalized_force_nm"), (arm.inverse_dynamics, "acceleration")):
            rows = method(u, velocity, force)
            np.testing.assert_array_equal(rows, method(list(u), velocity, force))
            np.testing.assert_array_equal(rows, method(u, velocity, **{name: force}))
            np.testing.assert_array_equal(rows, method(u, velocity, np.repeat(force, 2)[::2]))
            np.testing.assert_array_equal(rows, type(arm).__dict__[method.__name__](arm, u, velocity, force))
            wrong = ((velocity[1:], "velocity: expected 6 numbers, got 5"), (np.full(6, np.inf), "velocity: expected finite numbers"))
            for value, said in wrong:
                with self.assertRaisesRegex(ValueError, said):
                    method(u, value, force)
            for arguments in ((u, velocity), (u, velocity, "force"), (u, velocity, force, force)):
                with self.assertRaises(TypeError):
                    method(*arguments)
            with self.assertRaises(TypeError):
                type(arm).__dict__[method.__name__](u, u, velocity, force)
            self.assertIn("(2n,)", method.__doc__)

    def test_the_arc_ends_where_the_segments_do(self):
        arm = softarm.Arm(softarm.load_experiment(PAPER_ARM))
        u = np.array([0.3, -0.2, 0.0, 0.0, 1.5, 2.0])
        line = arm.centre_line(u, 10)
        np.testing.assert_allclose(line[10::10], arm.segment_poses(u)[:, :3, 3], atol=1e-15)
        np.testing.assert_allclose(np.linalg.norm(np.diff(line[11:21], axis=0), axis=1), 0.011, rtol=1e-12)
        np.testing.assert_allclose(softarm.polar_to_u(softarm.u_to_polar(u)), u, atol=1e-15)

    def test_derivatives_are_those_of_the_functions(self):
        """Against central differences of the functions themselves; the numerics tests hold them against 80-bit ones."""
        experiment = softarm.load_experiment(PAPER_ARM)
        arm, allocator = softarm.Arm(experiment), softarm.Allocator(experiment)
        random = np.random.default_rng(4)
        u, velocity = random.normal(size=(2, arm.dof))
        pressure = random.uniform(0.0, 1.0, allocator.chambers)

        def slope(f, x, step=1e-5):
            return np.column_stack([(f(x + d) - f(x - d)) / (2 * step) for d in step * np.eye(len(x))])

        force = allocator.generalized_force(pressure)
        acceleration, by_u, by_velocity, by_force = arm.forward_dynamics_derivatives(u, velocity, force)
        np.testing.assert_allclose(acceleration, arm.forward_dynamics(u, velocity, force), rtol=1e-10)
        size = np.abs(acceleration).max()
        for got, want in (
            (by_u, slope(lambda x: arm.forward_dynamics(x, velocity, force), u)),
            (by_velocity, slope(lambda x: arm.forward_dynamics(u, x, force), velocity)),
            (
                by_force @ allocator.input_matrix,
                slope(lambda p: arm.forward_dynamics(u, velocity, allocator.generalized_force(p)), pressure),
            ),
        ):
            np.testing.assert_allclose(got, want, rtol=0, atol=1e-7 * (size + np.abs(want).max()))
        np.testing.assert_allclose(arm.static_stiffness(u), slope(arm.static_moments, u), atol=1e-8)
        np.testing.assert_allclose(
            arm.inverse_dynamics_by_u(u, velocity, acceleration),
            slope(lambda x: arm.inverse_dynamics(x, velocity, acceleration), u),
            atol=1e-7,
        )
        self.assertEqual(np.abs(arm.actuation_slope(u, force)).max(), 0.0)

    def test_the_shape_at_rest_moves_as_its_stiffness_says(self):
        experiment = softarm.load_experiment(PAPER_ARM)
        arm = softarm.Arm(experiment)
        moments = np.array([0.1, -0.2, 0.05, 0.1, 0.0, 0.1])
        u = arm.rest_shape(moments)
        step = 1e-5 * np.array([1.0, 2.0, -1.0, 0.5, 1.0, -2.0])
        moved = (arm.rest_shape(moments + step) - arm.rest_shape(moments - step)) / 2
        np.testing.assert_allclose(np.linalg.solve(arm.static_stiffness(u), arm.actuation_matrix(u) @ step), moved, atol=1e-12)

    def test_what_does_not_fit_is_named(self):
        arm = softarm.Arm(softarm.load_experiment(PAPER_ARM))
        with self.assertRaisesRegex(ValueError, "u: expected 6 numbers, got 4"):
            arm.tip(np.zeros(4))
        with self.assertRaisesRegex(ValueError, "velocity: expected finite numbers"):
            arm.dynamics_matrices(np.zeros(6), np.full(6, np.nan))
        with self.assertRaisesRegex(ValueError, "mass: expected 'point' or 'distributed'"):
            softarm.Arm(length_m=[1], mass_kg=[1], stiffness_nm_per_rad=[1], damping_nms_per_rad=[1], mass="none")
        with self.assertRaisesRegex(ValueError, "base_rotation"):
            softarm.Arm(length_m=[1], mass_kg=[1], stiffness_nm_per_rad=[1], damping_nms_per_rad=[1], base_rotation=np.ones((3, 3)))


class Configuration(unittest.TestCase):
    def test_an_error_has_its_parts(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "wrong.yaml"
            file.write_text(f"include: {PAPER_ARM}\narm:\n  segments: 0\n")
            with self.assertRaises(softarm.ConfigError) as caught:
                softarm.load_experiment(file)
        error = caught.exception
        self.assertEqual((error.file, error.line, error.key), (str(file), 3, "arm.segments"))
        self.assertIn(error.expected, str(error))
        self.assertIsInstance(error, ValueError)


class Simulation(unittest.TestCase):
    def test_run_is_the_program_s(self):
        """The same numbers as `softarm run` writes."""
        experiment = softarm.load_experiment(PAPER_ARM)
        experiment.seed = 3
        log = softarm.run(experiment, 1.5)
        with tempfile.TemporaryDirectory() as out:
            subprocess.run(
                [BIN / "softarm", "run", PAPER_ARM, "--seed", "3", "--duration", "1.5", "--out", out, "--no-plots"],
                check=True,
                capture_output=True,
            )
            table = np.genfromtxt(pathlib.Path(out) / "log.csv", delimiter=",", names=True, skip_header=1, dtype=None, encoding="utf-8")
        self.assertEqual(len(table), len(log["t_s"]))
        np.testing.assert_array_equal(table["mode"], log["mode"])
        self.assertEqual(log["mode"][-1], "ACTIVE")
        for prefix, unit, column in (("u", "rad", "u"), ("ref", "rad", "u_ref"), ("true", "rad", "u_true")):
            names = [f"{prefix}{segment}_{axis}_{unit}" for segment in (1, 2, 3) for axis in "xy"]
            np.testing.assert_allclose(np.array([table[name] for name in names]).T, log[column], rtol=1e-8)
        for prefix, column in (("p", "command_bar"), ("pm", "pressure_bar")):
            names = [f"{prefix}{segment}_{chamber}_bar" for segment in (1, 2, 3) for chamber in (1, 2, 3, 4)]
            np.testing.assert_allclose(np.array([table[name] for name in names]).T, log[column], rtol=1e-8)

    def test_the_loop_written_out_is_run(self):
        """Pipeline and simulated arm, tick by tick in Python: bit for bit what run() gives."""
        experiment = softarm.load_experiment(PAPER_ARM)
        log = softarm.run(experiment, 1.0)
        pipeline, arm = softarm.ControlPipeline(experiment), softarm.SimulatedArm(experiment)
        for k in range(len(log["t_s"])):
            now_ns = k * pipeline.period_ns
            arm.advance_to(now_ns)
            measured = arm.plant.pressure_bar.astype(np.float32)
            tick = pipeline.tick(now_ns, arm.receive(), measured_bar=measured, go=True)
            arm.command(tick.pressure_bar, 0.1, now_ns)
            arm.advance_to(now_ns + pipeline.period_ns // 2)  # where run() looks
            np.testing.assert_array_equal(tick.pressure_bar, log["command_bar"][k])
        self.assertEqual(tick.mode, "ACTIVE")
        with self.assertRaisesRegex(ValueError, "now_ns"):
            pipeline.tick(now_ns)

    def test_frames_are_what_the_caller_says(self):
        experiment = softarm.load_experiment(PAPER_ARM)
        arm = softarm.SimulatedArm(experiment)
        arm.advance_to(100_000_000)
        frame = arm.receive()[3]
        again = softarm.Frame(frame.frame_number, frame.capture_ns, frame.poses)
        np.testing.assert_array_equal(again.poses, frame.poses)
        self.assertEqual(frame.poses.shape, (experiment.segments + 1, 7))

    def test_many_plants_are_each_one(self):
        experiment = softarm.load_experiment(PAPER_ARM)
        commands = np.random.default_rng(2).uniform(0.0, 1.0, (5, 12))
        alone = [softarm.Plant(experiment) for _ in commands]
        for plant, command in zip(alone, commands):
            plant.advance(0.3, command)
        for threads in (1, 3):
            together = [softarm.Plant(experiment) for _ in commands]
            softarm.advance(together, 0.3, commands, threads=threads)
            for one, other in zip(alone, together):
                np.testing.assert_array_equal(one.u, other.u)
        with self.assertRaisesRegex(ValueError, "each one once"):
            softarm.advance([alone[0], alone[0]], 0.1, commands[:2])
        with self.assertRaisesRegex(ValueError, "5 rows"):
            softarm.advance(alone, 0.1, commands[:2])

    def test_a_plant_comes_to_rest_where_statics_says(self):
        experiment = softarm.load_experiment(PAPER_ARM)
        arm, plant, allocator = softarm.Arm(experiment), softarm.Plant(experiment), softarm.Allocator(experiment)
        u = np.array([0.4, 0.1, -0.2, 0.3, 0.0, 0.5])
        moments = np.linalg.solve(arm.actuation_matrix(u), arm.static_moments(u))
        pressures, scale = allocator.allocate(moments)
        np.testing.assert_array_equal(scale, 1.0)
        plant.advance(12.0, pressures)
        np.testing.assert_allclose(plant.u, u, atol=1e-6)
        np.testing.assert_allclose(arm.rest_shape(moments), u, atol=1e-9)
        np.testing.assert_allclose(plant.segment_poses, arm.segment_poses(u), atol=1e-6)


class Stretching(unittest.TestCase):
    """Where segments stretch every state has three numbers a segment."""

    EXPERIMENT = softarm.load_experiment(ROOT / "config/paper_arm_stretching.yaml")

    def test_the_arc_ends_where_the_segments_do(self):
        arm = softarm.Arm(self.EXPERIMENT)
        u = np.array([0.4, -0.3, 0.01, 0.0, 0.7, -0.004, -0.9, 0.2, 0.02])
        line = arm.centre_line(u, 7)
        self.assertEqual(line.shape, (22, 3))
        np.testing.assert_allclose(line[7::7], np.array(arm.segment_poses(u))[:, :3, 3], atol=1e-12)
        pieces = np.linalg.norm(np.diff(arm.centre_line(u, 400), axis=0), axis=1).reshape(3, 400).sum(axis=1)
        np.testing.assert_allclose(pieces, arm.length_m + u[2::3], rtol=1e-5)

    def test_the_input_matrix_is_that_of_the_force(self):
        allocator = softarm.Allocator(self.EXPERIMENT)
        pressure_bar = np.linspace(0.1, 1.2, 12)
        force = allocator.generalized_force(pressure_bar)
        self.assertEqual(force.shape, (9,))
        u = np.array([0.4, -0.3, 0.01, 0.0, 0.7, -0.004, -0.9, 0.2, 0.02])
        moments = np.linalg.solve(softarm.Arm(self.EXPERIMENT).actuation_matrix(u), force)
        np.testing.assert_allclose(moments[2::3], force[2::3], rtol=1e-12)
        pressures, scale = allocator.allocate(moments)
        np.testing.assert_array_equal(scale, 1.0)
        np.testing.assert_allclose(allocator.generalized_force(pressures), force, atol=1e-9)
        np.testing.assert_allclose(allocator.input_matrix @ pressure_bar, force, rtol=1e-12)

    def test_a_plant_has_its_elongation(self):
        plant = softarm.Plant(self.EXPERIMENT)
        for _ in range(20):
            plant.advance(0.2, np.full(12, 0.5))
        self.assertEqual((plant.u.size, plant.elongation_m.size), (6, 3))
        state = np.ravel([[*u, e] for u, e in zip(plant.u.reshape(3, 2), plant.elongation_m, strict=True)])
        np.testing.assert_allclose(softarm.Arm(self.EXPERIMENT).tip(state), plant.tip_m, atol=1e-6)
        self.assertGreater(plant.elongation_m.min(), 1e-3)
        self.assertEqual(softarm.Plant(softarm.load_experiment(PAPER_ARM)).elongation_m.size, 0)


class Stubs(unittest.TestCase):
    def test_name_what_the_module_has(self):
        """Editors read _core.pyi: every public name and member of the module stands in it."""
        stub = (ROOT / "python/softarm/_core.pyi").read_text()
        core = sys.modules["softarm._core"]
        for name in dir(core):
            if name.startswith("_"):
                continue
            value = getattr(core, name)
            self.assertRegex(stub, rf"(class|def) {name}\b")
            for member in vars(value) if isinstance(value, type) else ():
                if not member.startswith("_"):
                    self.assertRegex(stub, rf"def {member}\b", f"{name}.{member}: see tools/python_stubs")


if __name__ == "__main__":
    unittest.main()
