"""
C++ part of the package softarm
"""
from __future__ import annotations
import numpy
import os
import typing
__all__: list[str] = ['Allocator', 'Arm', 'ArmClient', 'ControlPipeline', 'Controller', 'Experiment', 'Frame', 'Plant', 'PlantError', 'PlantState', 'SimulatedArm', 'Status', 'Tick', 'TransportError', 'advance', 'load_experiment', 'polar_to_u', 'run', 'u_to_polar']
class Experiment:
    """
    An experiment as in its file, checked, with every default filled in.
    """
    def __repr__(self) -> str:
        ...
    @property
    def chambers(self) -> list[int]:
        """
        number of chambers of every segment
        """
    @property
    def duration_s(self) -> float:
        ...
    @property
    def max_theta_rad(self) -> float:
        """
        soft limit of every segment's bending angle, rad
        """
    @property
    def name(self) -> str:
        ...
    @property
    def pressure_limits_bar(self) -> tuple:
        """
        lowest and highest command, bar (N m with actuation by torque)
        """
    @property
    def rate_hz(self) -> float:
        """
        of the control tick, Hz
        """
    @property
    def seed(self) -> int:
        """
        of noise and dropouts of the simulated arm
        """
    @seed.setter
    def seed(self, arg1: int) -> None:
        ...
    @property
    def segments(self) -> int:
        ...
    @property
    def text(self) -> str:
        """
        the whole configuration as YAML with every default
        """
    @property
    def warnings(self) -> list[str]:
        """
        what is allowed but probably not intended, one sentence each
        """
class Arm:
    """
    The model of an arm of n segments with constant curvature.
    
    The state is u = theta [cos phi, sin phi] of every segment, (2n,), rad. Where segments stretch it
    is (u_x, u_y, e) of every segment, (3n,), with e in m, and forces along e are in N.
    A wrong size, NaN or inf raises ValueError. Not for two threads at a time.
    """
    @staticmethod
    def __init__(*args, **kwargs):
        """
        __init__(*args, **kwargs)
        Overloaded function.
        
        1. __init__(self: softarm._core.Arm, length_m: numpy.ndarray[numpy.float64[m, 1]], mass_kg: numpy.ndarray[numpy.float64[m, 1]], stiffness_nm_per_rad: numpy.ndarray[numpy.float64[m, 1]], damping_nms_per_rad: numpy.ndarray[numpy.float64[m, 1]], mass: str = 'distributed', actuation: str = 'chamber', base_rotation: numpy.ndarray[numpy.float64[3, 3]] = array([[ 1.,  0.,  0.],
               [ 0., -1.,  0.],
               [ 0.,  0., -1.]]), base_position_m: numpy.ndarray[numpy.float64[3, 1]] = array([0., 0., 0.]), gravity_mps2: numpy.ndarray[numpy.float64[3, 1]] = array([ 0.  ,  0.  , -9.81])) -> None
        
        One number a segment each. The default base hangs the arm from a ceiling.
        
        2. __init__(self: softarm._core.Arm, experiment: softarm._core.Experiment) -> None
        
        The arm as the experiment's controller models it.
        """
    def actuation_matrix(self, u: numpy.ndarray) -> numpy.ndarray:
        """
        A(u), (2n, 2n): generalized force = A tau_A; (15).
        """
    def actuation_slope(self, u: numpy.ndarray, tau_actuation_nm: numpy.ndarray) -> numpy.ndarray:
        """
        d (A(u) tau_A) / du with tau_A held, (2n, 2n), N m/rad; zero for 'chamber'.
        """
    def centre_line(self, u: numpy.ndarray, points_per_segment: int = 16) -> numpy.ndarray:
        """
        Points on the arm from base to tip, (n points_per_segment + 1, 3), m, world.
        """
    def dynamics_matrices(self, u: numpy.ndarray, velocity: numpy.ndarray) -> tuple:
        """
        B(u) in kg m^2, C(u, u') (Christoffel, B' - 2C is skew) in kg m^2/s, G(u) in N m.
        """
    def forward_dynamics(self, u: numpy.ndarray, velocity: numpy.ndarray, generalized_force_nm: numpy.ndarray) -> numpy.ndarray:
        """
        u'' of (16), (2n,), rad/s^2, for a generalized force A tau_A + J' f in N m.
        """
    def forward_dynamics_derivatives(self, u: numpy.ndarray, velocity: numpy.ndarray, generalized_force_nm: numpy.ndarray) -> tuple:
        """
        (u'', d u''/du, d u''/du', d u''/d force), force held: (2n,) and three of (2n, 2n).
        
        Exact. By pressures: by_force @ allocator.input_matrix; a force that depends on u adds
        by_force @ (its slope) to the second.
        """
    def gravity(self, u: numpy.ndarray) -> numpy.ndarray:
        """
        G(u), (2n,), N m.
        """
    def gravity_potential(self, u: numpy.ndarray) -> float:
        """
        Potential energy of gravity, J; zero at the world's origin.
        """
    def inertia(self, u: numpy.ndarray) -> numpy.ndarray:
        """
        B(u), (2n, 2n), kg m^2.
        """
    def inverse_dynamics(self, u: numpy.ndarray, velocity: numpy.ndarray, acceleration: numpy.ndarray) -> numpy.ndarray:
        """
        Generalized force B u'' + C u' + D u' + G + K u of (16), (2n,), N m; O(n).
        """
    def inverse_dynamics_by_u(self, u: numpy.ndarray, velocity: numpy.ndarray, acceleration: numpy.ndarray) -> numpy.ndarray:
        """
        d inverse_dynamics / du with u' and u'' held, (2n, 2n), N m/rad; exact. By u': 2 C + D,
        by u'': B.
        """
    def kinetic_energy(self, u: numpy.ndarray, velocity: numpy.ndarray) -> float:
        """
        1/2 u'^T B u', J.
        """
    def mass_centres(self, u: numpy.ndarray) -> numpy.ndarray:
        """
        Centre of mass of every segment, (n, 3), m, world; (5).
        """
    def rest_shape(self, tau_actuation_nm: numpy.ndarray) -> numpy.ndarray | None:
        """
        u at rest near straight under constant moments, (2n,), rad; None without convergence.
        """
    def segment_poses(self, u: numpy.ndarray) -> numpy.ndarray:
        """
        World pose of every segment's end, (n, 4, 4), m; (1).
        """
    def static_moments(self, u: numpy.ndarray) -> numpy.ndarray:
        """
        K u + G(u), (2n,), N m: the generalized force that holds u at rest.
        """
    def static_stiffness(self, u: numpy.ndarray) -> numpy.ndarray:
        """
        K + dG/du, (2n, 2n), N m/rad: the slope of static_moments, exact. The shape at rest moves
        by solve(static_stiffness(u), allocator.input_matrix) for 1 bar in each chamber.
        """
    def tip(self, u: numpy.ndarray) -> numpy.ndarray:
        """
        Position of the tip, (3,), m, world.
        """
    def tip_force(self, u: numpy.ndarray, force_n: numpy.ndarray) -> numpy.ndarray:
        """
        J' f of a force on the tip (N, world), (2n,), N m.
        """
    def tip_jacobian(self, u: numpy.ndarray) -> numpy.ndarray:
        """
        d tip / d u, (3, 2n), m/rad, world.
        """
    def tip_jacobian_rate(self, u: numpy.ndarray, velocity: numpy.ndarray) -> numpy.ndarray:
        """
        Time derivative of tip_jacobian, (3, 2n), m/(rad s).
        """
    @property
    def damping_nms_per_rad(self) -> numpy.ndarray:
        ...
    @property
    def dof(self) -> int:
        ...
    @property
    def length_m(self) -> numpy.ndarray:
        ...
    @property
    def mass_kg(self) -> numpy.ndarray:
        ...
    @property
    def segments(self) -> int:
        ...
    @property
    def stiffness_nm_per_rad(self) -> numpy.ndarray:
        ...
class Allocator:
    """
    From actuation torques to chamber pressures, and back.
    """
    def __init__(self, experiment: Experiment) -> None:
        ...
    def allocate(self, tau_actuation_nm: numpy.ndarray) -> tuple:
        """
        Pressures (bar) nearest the bias that give s tau, and s of every segment: below 1 where
        the chambers cannot reach tau (2n, N m) within their limits. For a generalized force in u:
        allocate(solve(arm.actuation_matrix(u), force)).
        """
    def generalized_force(self, pressure_bar: numpy.ndarray) -> numpy.ndarray:
        """
        Generalized force in u that pressures give, (2n,), N m; where segments stretch (3n,).
        """
    @property
    def chambers(self) -> int:
        ...
    @property
    def input_matrix(self) -> numpy.ndarray:
        """
        d generalized_force / d pressure, (2n, chambers), N m/bar: it does not depend on u.
        Where segments stretch (3n, chambers), every third row in N/bar.
        """
class Controller:
    """
    The controller (17) of an experiment.
    """
    def __init__(self, experiment: Experiment) -> None:
        ...
    def compute(self, u: numpy.ndarray, velocity: numpy.ndarray, u_ref: numpy.ndarray, velocity_ref: numpy.ndarray, acceleration_ref: numpy.ndarray) -> numpy.ndarray:
        """
        tau_A, (2n,), N m, from the state and the reference with its derivatives.
        """
class Frame:
    """
    One motion-capture frame.
    """
    def __init__(self, frame_number: int, capture_ns: int, poses: numpy.ndarray) -> None:
        """
        poses: (n + 1, 7), base first, [x, y, z, qw, qx, qy, qz] in m; a row with NaN was not seen.
        """
    @property
    def capture_ns(self) -> int:
        ...
    @property
    def frame_number(self) -> int:
        ...
    @property
    def poses(self) -> numpy.ndarray:
        ...
class Tick:
    """
    What one tick saw, decided and commands; vectors are empty where unknown.
    """
    @property
    def armed(self) -> bool:
        ...
    @property
    def frame_age_s(self) -> float:
        ...
    @property
    def mode(self) -> str:
        ...
    @property
    def pressure_bar(self) -> numpy.ndarray:
        ...
    @property
    def reason(self) -> str:
        ...
    @property
    def saturated(self) -> bool:
        ...
    @property
    def slew_limited(self) -> bool:
        ...
    @property
    def tau_actuation_nm(self) -> numpy.ndarray:
        ...
    @property
    def u(self) -> numpy.ndarray:
        ...
    @property
    def u_ref(self) -> numpy.ndarray:
        ...
    @property
    def velocity(self) -> numpy.ndarray:
        ...
    @property
    def velocity_ref(self) -> numpy.ndarray:
        ...
class ControlPipeline:
    """
    The daemon's tick: validate, estimate, safety, (17), allocate, limit.
    """
    def __init__(self, experiment: Experiment) -> None:
        ...
    def tick(self, now_ns: int, frames: list[Frame] = [], measured_bar: numpy.ndarray | None = None, arm: bool = False, disarm: bool = False, emergency_stop: bool = False, go: bool = False) -> Tick:
        """
        One tick at a time (ns, one monotonic clock, never going back) with the frames that came
        since the last one. arm, disarm, emergency_stop: an operator's requests; go: a dead-man's.
        """
    @property
    def period_ns(self) -> int:
        ...
class PlantError(RuntimeError):
    pass
class LawState:
    """
    What a control law of one's own is to answer, of the instant at which its answer acts. Unless
    ACTIVE, the reference rests where the arm is. Of segments that stretch (u_x, u_y, e) each:
    3n in place of 2n, every third number in m.
    """
    def __repr__(self) -> str:
        ...
    @property
    def acceleration_ref(self) -> numpy.ndarray:
        """
        (2n,), rad/s^2
        """
    @property
    def active_s(self) -> float:
        """
        since the arm became ACTIVE, otherwise 0
        """
    @property
    def mode(self) -> str:
        ...
    @property
    def pressure_bar(self) -> numpy.ndarray:
        """
        commanded, (chambers,), bar
        """
    @property
    def tick(self) -> int:
        ...
    @property
    def u(self) -> numpy.ndarray:
        """
        (2n,), rad
        """
    @property
    def u_ref(self) -> numpy.ndarray:
        """
        (2n,), rad
        """
    @property
    def velocity(self) -> numpy.ndarray:
        """
        (2n,), rad/s
        """
    @property
    def velocity_ref(self) -> numpy.ndarray:
        """
        (2n,), rad/s
        """
class Plant:
    """
    The simulated arm of an experiment behind its valves, with its true state.
    
    Starts at rest without pressure; the same calls give the same bits.
    """
    def __init__(self, experiment: Experiment) -> None:
        ...
    def advance(self, duration_s: float, command_bar: numpy.ndarray) -> None:
        """
        Integrate with a command (bar, one a chamber) held. Raises PlantError where the
        integrator fails.
        """
    def reset(self, u: numpy.ndarray, velocity: numpy.ndarray, pressure_bar: numpy.ndarray) -> None:
        """
        Put the arm into another state; the time stays.
        """
    @property
    def chambers(self) -> int:
        ...
    @property
    def elongation_m(self) -> numpy.ndarray:
        """
        e of every segment, (n,); empty where segments do not stretch
        """
    @property
    def elongation_rate_mps(self) -> numpy.ndarray:
        """
        the same of e'
        """
    @property
    def pressure_bar(self) -> numpy.ndarray:
        ...
    @property
    def segment_poses(self) -> numpy.ndarray:
        ...
    @property
    def segments(self) -> int:
        ...
    @property
    def time_s(self) -> float:
        ...
    @property
    def tip_m(self) -> numpy.ndarray:
        ...
    @property
    def u(self) -> numpy.ndarray:
        ...
    @property
    def velocity(self) -> numpy.ndarray:
        ...
class SimulatedArm:
    """
    A plant with motion capture and valves that vent when commands expire.
    """
    def __init__(self, experiment: Experiment, start_ns: int = 0) -> None:
        ...
    def advance_to(self, now_ns: int) -> None:
        ...
    def command(self, pressure_bar: numpy.ndarray, validity_s: float, now_ns: int) -> None:
        """
        Set points (bar) that arrive at now_ns; the valves vent when validity_s has passed.
        """
    def receive(self) -> list[Frame]:
        """
        The frames that have arrived and were not fetched yet.
        """
    @property
    def plant(self) -> Plant:
        ...
    @property
    def time_ns(self) -> int:
        ...
    @property
    def vented(self) -> bool:
        ...
class Status:
    """
    What the daemon measured, decided and commanded in one tick.
    """
    def __repr__(self) -> str:
        ...
    @property
    def armed(self) -> bool:
        ...
    @property
    def elongation_m(self) -> numpy.ndarray:
        """
        e of every segment, (n,); empty where segments do not stretch
        """
    @property
    def elongation_ref_m(self) -> numpy.ndarray:
        """
        the same of the reference, NaN unless ACTIVE
        """
    @property
    def frame_age_s(self) -> float:
        ...
    @property
    def frames_rejected(self) -> int:
        ...
    @property
    def law_answers(self) -> dict:
        """
        answers of an external law, by what became of them
        """
    @property
    def law_round_trip_s(self) -> float:
        ...
    @property
    def references_refused(self) -> dict:
        """
        live references and targets of the tip that were refused, by reason
        """
    @property
    def mode(self) -> str:
        ...
    @property
    def pressure_bar(self) -> numpy.ndarray:
        """
        commanded
        """
    @property
    def reason(self) -> str:
        ...
    @property
    def reference_limited(self) -> bool:
        ...
    @property
    def saturated(self) -> bool:
        ...
    @property
    def slew_limited(self) -> bool:
        ...
    @property
    def soft_limit(self) -> bool:
        ...
    @property
    def tau_actuation_nm(self) -> numpy.ndarray:
        """
        NaN unless ACTIVE
        """
    @property
    def tick(self) -> int:
        ...
    @property
    def time_us(self) -> int:
        ...
    @property
    def u(self) -> numpy.ndarray:
        ...
    @property
    def u_ref(self) -> numpy.ndarray:
        """
        NaN unless ACTIVE
        """
    @property
    def velocity(self) -> numpy.ndarray:
        ...
class PlantState:
    """
    The true state of a simulated arm.
    """
    @property
    def elongation_m(self) -> numpy.ndarray:
        """
        e of every segment, (n,); empty where segments do not stretch
        """
    @property
    def pressure_bar(self) -> numpy.ndarray:
        ...
    @property
    def time_us(self) -> int:
        ...
    @property
    def tip_m(self) -> numpy.ndarray:
        ...
    @property
    def u(self) -> numpy.ndarray:
        ...
    @property
    def velocity(self) -> numpy.ndarray:
        ...
    @property
    def vented(self) -> bool:
        ...
class TransportError(RuntimeError):
    pass
class ArmClient:
    """
    A running arm, real or simulated: status, requests, references, chamber commands.
    
    Messages are handled in update, wait_for_status and request only. For one thread at a time.
    """
    def __init__(self, experiment: Experiment) -> None:
        ...
    def answer_law(self, state: LawState, values: numpy.ndarray, pressures: bool = False, validity_s: float = 0.05) -> None:
        """
        Answer it by a generalized force (as long as u; N m, along e N) or by pressures (bar, one a
        chamber), valid for validity_s from the state on.
        """
    def command_chambers(self, pressure_bar: numpy.ndarray) -> None:
        """
        Move the set points towards these (bar, one a chamber) within the experiment's limits and
        send them when due. The valves vent by themselves when calls stop.
        """
    def lock_commands(self) -> None:
        """
        Take softarmd's place on this machine. RuntimeError while another program has it.
        """
    def record(self, log: os.PathLike) -> None:
        """
        Write every message to an LCM event log from now on.
        """
    def request(self, what: str, patience_s: float = 2.0) -> str:
        """
        'arm', 'disarm' or 'emergency_stop', until a status shows it: 'done', 'refused' (the
        daemon reports otherwise) or 'unheard' (no daemon reports).
        """
    def send_go(self, go: bool) -> None:
        """
        The dead-man input, held or released.
        """
    def send_reference(self, u: numpy.ndarray, velocity: numpy.ndarray, acceleration: numpy.ndarray) -> None:
        """
        u, u', u'' (2n each; rad, rad/s, rad/s^2) for a daemon whose phase is `live`.
        """
    def send_tip_target(self, position_m: numpy.ndarray, velocity_mps: numpy.ndarray = ...) -> None:
        """
        A target of the tip in the world (m, m/s) for a daemon whose phase is `live_tip`.
        """
    def stop_recording(self) -> None:
        ...
    def update(self, patience_s: float = 0.0) -> bool:
        """
        Wait for a message for at most patience_s and handle all that have arrived; whether any did.
        """
    def vent_to_rest(self) -> None:
        """
        Vent completely; blocks.
        """
    def wait_for_law_state(self, patience_s: float) -> LawState | None:
        """
        The next state that a law of one's own is to answer; None if none comes.
        """
    def wait_for_status(self, patience_s: float) -> bool:
        """
        Handle messages until the next status; False if none comes within patience_s.
        """
    @property
    def measured_bar(self) -> numpy.ndarray | None:
        """
        pressures measured by the valves, bar; None before the first
        """
    @property
    def other_commander(self) -> str:
        ...
    @property
    def plant(self) -> PlantState | None:
        ...
    @property
    def seen_u(self) -> numpy.ndarray:
        """
        u in the newest motion-capture frame that showed every segment; empty before the first
        """
    @property
    def status(self) -> Status | None:
        ...
def advance(plants: list[Plant], duration_s: float, commands_bar: numpy.ndarray, threads: int = 0) -> None:
    """
    Advance many plants at once, row i of commands_bar for plants[i], on worker threads
    (0: one a core). The result does not depend on their number.
    """
def load_experiment(file: os.PathLike) -> Experiment:
    """
    Read and check an experiment in YAML, with the files that it includes.
    
    Raises ConfigError with file, line, key, expected and got.
    """
def polar_to_u(q: numpy.ndarray) -> numpy.ndarray:
    """
    u of [phi_1, theta_1, ...], rad.
    """
def run(experiment: Experiment, duration_s: float, law: typing.Any = None) -> dict:
    """
    Run an experiment in lock step; a dict of arrays with one row a tick:
    t_s, mode, u, u_ref, u_true (rad), command_bar, pressure_bar, tip_m (world).
    law: a control law of one's own in place of the experiment's, see softarm.law.
    """
def u_to_polar(u: numpy.ndarray) -> numpy.ndarray:
    """
    [phi_1, theta_1, ...] of u, rad; phi is 0 where theta is.
    """
__version__: str = '0.1.0'
