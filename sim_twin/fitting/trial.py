"""A virtual arm that differs from its file in ways that are known, made to move, and recorded: what a fit is judged by.

The arm is the virtual controller's own, its program interpreted, its servoj, its faults, its noise; only its wires and
its clock are left out. The fit is given the session's file and nothing else.
"""

from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig
from config.loader import resolve
from config.resolved import Resolved
from config.rig import PlantExpected
from robot.geometry import quat_of_rotation_vector, vec6
from robot.layout import draw_layout
from robot.messages import ArmCommand, ArmMode, ArmState, GripCommand, GripState, PlantKind
from robot.recording.messages import Purpose
from robot.recording.recording import Recording
from robot.tick_tap import TickTap
from sim_twin.controller.faults import Faults
from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.motion.servo import filter_lag_s
from sim_twin.controller.robot import VirtualRobot
from sim_twin.controller.ticks import TickTimes
from sim_twin.fitting.excitation import excite
from sim_twin.fitting.lengths import FIELDS
from sim_twin.fitting.values import JOINTS
from sim_twin.plant import TwinWorld

__all__ = ["Differing", "Driven", "differing", "record_trial"]

Array = NDArray[np.float64]
RAISED_RAD = (0.0, -0.35, -0.2, 0.3, 0.0, 0.0)
"""From the arm's home, so that no motion of a trial reaches the table."""
REACH_RAD, ACCELERATION_RAD_S2 = 0.2, 12.0
FIRST_REGISTER = 24
SETTLE_SLICES = 250
_REGISTERS = ",".join(f"read_input_float_register({FIRST_REGISTER + i})" for i in range(6))
_FOLLOW = """def follow():
  while True:
    servoj([{registers}], 0, 0, {slice_s}, {lookahead_s}, {gain})
  end
end
"""


class Differing(msgspec.Struct, frozen=True, kw_only=True):
    """How an arm differs from its file. Joints are base to wrist 3."""

    friction_nm: tuple[float, ...] = (0.0,) * 6
    viscous_nm_s: tuple[float, ...] = (0.0,) * 6
    payload_kg: float = 0.0
    stiffness: float = 1.0
    """Times that of the twin's servos."""
    damping: float = 1.0
    dead_time_s: float = 0.004
    lookahead_s: float = 0.03
    """Of servoj, in the program."""
    mm: float = 0.0
    """Of the controller's Denavit-Hartenberg rows, off by as much at most."""
    mrad: float = 0.0
    noise_rad: float = 3e-5


def differing(rng: np.random.Generator) -> Differing:
    """Draw an arm that differs in everything, and has a joint that drags."""
    friction = rng.uniform([1.0, 1.0, 1.0, 0.2, 0.2, 0.2], [5.0, 5.0, 5.0, 1.2, 1.2, 1.2])
    friction[rng.integers(6)] *= 3.0
    return Differing(
        friction_nm=tuple(friction.tolist()),
        viscous_nm_s=tuple(rng.uniform(0.0, [20.0, 20.0, 20.0, 5.0, 5.0, 5.0]).tolist()),
        payload_kg=float(rng.uniform(0.3, 2.0)), stiffness=float(rng.uniform(0.7, 1.3)),
        damping=float(rng.uniform(0.8, 1.3)), dead_time_s=SLICE_S * int(rng.integers(1, 6)),
        lookahead_s=float(rng.uniform(0.045, 0.07)), mm=1.0, mrad=1.0,
    )  # fmt: skip


class Driven:
    """A virtual arm with faults that follows joints written to its registers, slice by slice.

    Args:
        resolved: what is known of it; its rig's tick is a slice.
        by: how it differs.
        seed: of its noise and lengths.

    Attributes:
        truth: What a fit should find, by the names of its rows.
        home_rad: Where it stands.  (6,)
    """

    def __init__(self, resolved: Resolved, by: Differing, *, seed: int) -> None:
        arm = _with_dead_time(resolved.arm, by.dead_time_s)
        world = TwinWorld(arm, resolved.scenario, resolved.rig)
        self.home_rad = np.add(arm.home_rad, RAISED_RAD)
        world.put(draw_layout(resolved.scenario, np.random.default_rng([seed, 0])), self.home_rad.tolist(), 0)
        self.robot = VirtualRobot(world)
        self._gain = arm.servo.gain
        drive = self.robot.machine.drive
        drive.core.set_tcp([*arm.tool.tcp_m, 0.0, 0.0, 0.0])
        faults = Faults(self.robot, None, TickTimes(), seed=seed)
        self.truth = _truth(self.robot, by, self._gain)
        faults.apply("servo", stiffness=by.stiffness, damping=by.damping)
        faults.apply("drag", nm=by.friction_nm, nm_s=by.viscous_nm_s)
        faults.apply("payload", kg=by.payload_kg)
        faults.apply("noise", rad=by.noise_rad)
        self.truth |= _length_truth(np.array(faults.apply("calibrate", mm=by.mm, mrad=by.mrad)["rows"]))
        self._write = [self.robot.machine.writer(f"input_double_register_{FIRST_REGISTER + i}") for i in range(6)]
        self._ask(self.home_rad)
        self.robot.submit_script(
            _FOLLOW.format(registers=_REGISTERS, slice_s=SLICE_S, lookahead_s=by.lookahead_s, gain=self._gain)
        )
        for _ in range(SETTLE_SLICES):
            self.robot.step()

    def measure(self) -> ArmState:
        """Return what its controller says."""
        machine = self.robot.machine
        told = machine.drive.measured
        x, y, z, rx, ry, rz = told.tcp_pose.tolist()
        vx, vy, vz = told.tcp_speed[:3].tolist()
        fx, fy, fz = told.wrench[:3].tolist()
        grip = GripState(opening_m=self.robot.hand.opening_m, is_moving=False, has_object=False)
        return ArmState(
            stamp_ns=machine.stamp_us * 1000, q_rad=vec6(told.q_rad.tolist()), qd_rad_s=vec6(told.qd_rad_s.tolist()),
            tcp_position_m=(x, y, z), tcp_quat=quat_of_rotation_vector(rx, ry, rz), tcp_speed_m_s=(vx, vy, vz),
            tcp_force_n=(fx, fy, fz), grip=grip, digital_in=machine.io.digital_in, digital_out=machine.io.digital_out,
            mode=ArmMode.RUNNING,
        )  # fmt: skip

    def follow(self, joints_rad: Array, tap: TickTap) -> None:
        """Ask for joints, one row a slice, and tell of each tick.  (n, 6)

        Raises:
            RuntimeError: the controller stopped the arm.
        """
        grip = GripCommand(opening_m=self.robot.hand.opening_m, force_n=20.0, speed_m_s=0.1)
        for k, q in enumerate(joints_rad):
            state = self.measure()
            tap.measured(state)
            asked = ArmCommand(
                stamp_ns=state.stamp_ns, sequence=k, q_rad=vec6(q.tolist()), grip=grip, digital_out=state.digital_out
            )
            tap.commanded(asked, (), None)
            self._ask(q)
            self.robot.step()
        if self.robot.is_idle:
            lines = [text for _, text in self.robot.machine.journal.lines]
            raise RuntimeError(f"trial: expected the arm to follow to the end, it was stopped: {lines[-2:]}")

    def moves(self, rng: np.random.Generator, seconds: float) -> Array:
        """Return joints that show much of it.  () -> (n, 6)"""
        off = excite(rng, seconds=seconds, tick_s=SLICE_S, reach_rad=REACH_RAD, acceleration_rad_s2=ACCELERATION_RAD_S2)
        return self.home_rad + off

    def _ask(self, q_rad: Array) -> None:
        for write, q in zip(self._write, q_rad.tolist(), strict=True):
            write(q)


def record_trial(path: Path, by: Differing, *, seed: int, seconds: float) -> dict[str, float]:
    """Record a session of such an arm, and return what is true of it, by the names of a fit's rows."""
    resolved = trial_config()
    driven = Driven(resolved, by, seed=seed)
    recording = Recording(path, resolved, purpose=Purpose.DRIVE, seed=seed)
    try:
        driven.follow(driven.moves(np.random.default_rng([seed, 2]), seconds), recording.ticks)
    finally:
        recording.close()
    return driven.truth


def trial_config() -> Resolved:
    """Return what a trial's session says that it is of: a virtual arm, in slices, without a wire."""
    resolved = resolve()
    expected = PlantExpected(kind=PlantKind.VIRTUAL, model=resolved.arm.name, serial="trial")
    rig = msgspec.structs.replace(resolved.rig, expected=expected, tick_s=SLICE_S, physics_s=SLICE_S)
    return msgspec.structs.replace(resolved, rig=rig)


def _with_dead_time(arm: ArmConfig, dead_time_s: float) -> ArmConfig:
    return msgspec.structs.replace(arm, servo=msgspec.structs.replace(arm.servo, dead_time_s=dead_time_s))


def _truth(robot: VirtualRobot, by: Differing, gain: float) -> dict[str, float]:
    """Return what is true of servos, friction and payload."""
    world, core = robot.machine.world, robot.machine.drive.core
    model, controls = world.model, world.joint_controls
    smoothing = filter_lag_s(
        lookahead_s=by.lookahead_s, gain=gain, dead_time_s=core.dead_time_s, servo_lag_s=core.servo_lag_s
    )
    stiffness = -model.actuator_biasprm[controls, 1] * by.stiffness
    damping = -model.actuator_biasprm[controls, 2] * by.damping
    lag = (damping + by.viscous_nm_s) / stiffness + smoothing + by.dead_time_s + SLICE_S / 2.0
    told = {"payload": by.payload_kg, "dead time": by.dead_time_s, "smoothing": smoothing}
    for name, values in (("lag", lag), ("stiffness", stiffness), ("friction", by.friction_nm)):
        told |= {f"{name} {joint}": float(value) for joint, value in zip(JOINTS, values, strict=True)}
    return told


def _length_truth(rows: Array) -> dict[str, float]:
    """Return what is true of lengths.  (6, 4)"""
    told = {
        f"{field.split('_')[0]} {joint}": float(value)
        for joint, row in zip(JOINTS, rows, strict=True)
        for field, value in zip(FIELDS, row, strict=True)
    }
    return told | {"d shoulder + elbow + wrist_1": float(rows[1:4, 1].sum())}
