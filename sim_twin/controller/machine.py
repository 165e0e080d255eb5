"""The controller's state without its programs: drive, modes, registers, terminals. What builtins and panels act on."""

from collections import deque
from collections.abc import Callable
from functools import partial

from sim_twin.controller.io import InputsOutputs
from sim_twin.controller.journal import Journal
from sim_twin.controller.modes import Modes
from sim_twin.controller.motion import SLICE_S, TwinDrive
from sim_twin.controller.motion.limits import Cause
from sim_twin.controller.motion.poses import Array
from sim_twin.controller.registers import Registers
from sim_twin.controller.states import Event, SafetyMode
from sim_twin.controller.watchdogs import Watchdogs
from sim_twin.controller.wire import ControllerVersion, Value
from sim_twin.plant import TwinWorld

__all__ = ["Machine"]

GRAVITY_M_S2 = 9.81
N_STEADY = 250
"""UR: 500 ms."""
_SLICE_US = round(SLICE_S * 1e6)


class Machine:
    """Everything that a program may touch.

    Args:
        world: The twin, with a tick of one slice.
        version: What the controller announces.

    Attributes:
        drive: The arm.
        modes: Power, safety, program.
        registers: General purpose registers.
        io: Terminals and the speed slider.
        watchdogs: Of the running program.
        journal: Log and robot messages.
        posted: Events that a program brought about; taken at the end of its slice.
        payload_inertia: (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), kg m², as told; the twin's dynamics do not use it.
        gravity: Direction and size as told (m/s², base axes); likewise.
        waypoint: UR pose of the last move's target; None before the first, and where a motion has none.
        n_moves: Moves along a path that programs are in.
        force_damping: Of the force modes to come.
        force_gain: Likewise.
        external_wrench: What a client writes as force and torque of its own sensor.
        is_shut_down: A program switched the controller off; who runs it looks.
        n_standing: Slices since the arm last moved.
        execution_s: What the slice before cost, where somebody measures it.
    """

    def __init__(self, world: TwinWorld, *, version: ControllerVersion) -> None:
        self.world, self.version = world, version
        self.drive = TwinDrive(world)
        self.modes = Modes()
        self.registers = Registers()
        self.io = InputsOutputs(set_slider=self.drive.core.pace.set_slider)
        self.watchdogs = Watchdogs()
        self.journal = Journal(stamp_us=lambda: self.drive.n_slices * _SLICE_US)
        self.posted: deque[Event] = deque()
        self.payload_inertia = [0.0] * 6
        self.gravity = [0.0, 0.0, GRAVITY_M_S2]
        self.waypoint: Array | None = None
        self.n_moves = 0
        self.force_damping, self.force_gain = 0.025, 1.0
        self.external_wrench = [0.0] * 6
        self.n_standing = 0
        self.is_shut_down = False
        self.execution_s = 0.0
        self._acceleration_slice = self._target_slice = -1
        self._acceleration = (0.0, 0.0, 0.0)
        self._target: tuple[list[float], list[float]] = ([], [])

    @property
    def time_s(self) -> float:
        """The controller's own time."""
        return self.drive.n_slices * SLICE_S

    @property
    def stamp_us(self) -> int:
        """The same in microseconds."""
        return self.drive.n_slices * _SLICE_US

    @property
    def is_steady(self) -> bool:
        """The arm rests, and neither complies nor is led."""
        core = self.drive.core
        return self.n_standing >= N_STEADY and core.force_task is None and not core.is_free

    def writer(self, name: str) -> Callable[[Value], None]:
        """Return what takes one input that a client writes; wire.InputSink."""
        wrote, store = self.watchdogs.wrote, self.registers.writer(name) or partial(self._take, name)

        def write(value: Value) -> None:
            wrote(name)
            store(value)

        return write

    def _take(self, name: str, value: Value) -> None:
        if not self.io.write(name, value) and name == "external_force_torque":
            self.external_wrench = [float(v) for v in value]  # pyright: ignore[reportGeneralTypeIssues,reportArgumentType] -- six by its type

    def tool_acceleration(self) -> tuple[float, float, float]:
        """Return what an accelerometer in the flange reads: how it moves, and gravity, in its own axes (m/s²)."""
        if self._acceleration_slice != self.drive.n_slices:
            T_bf = self.drive.kinematics.forward(self.drive.measured.q_rad)
            x, y, z = (T_bf[:3, :3].T @ (self.drive.measured.acceleration + self.gravity)).tolist()
            self._acceleration_slice, self._acceleration = self.drive.n_slices, (x, y, z)
        return self._acceleration

    def target_tool(self) -> tuple[list[float], list[float]]:
        """Return UR pose and speed (v, w) of the tool that the set-point asks for; found once a slice."""
        if self._target_slice != self.drive.n_slices:
            pose, speed = self.drive.core.target_tool()
            self._target_slice, self._target = self.drive.n_slices, (pose.tolist(), speed.tolist())
        return self._target

    def begin_program(self) -> None:
        """Put back what holds for one program only."""
        self.force_damping, self.force_gain = 0.025, 1.0
        self.watchdogs.clear()

    def note_safety(self, event: Event, joint: int | None) -> None:
        """Say what the safety mode is after an event, to the log and on the primary port."""
        safety, worn_out = self.modes.safety, Cause.TOO_MANY_STOPS
        is_new = safety is not self.journal.safety_mode
        if is_new and event is Event.PROTECTIVE_STOP and joint is not None and safety is SafetyMode.FAULT:
            self.journal.error(worn_out.code, joint, f"joint {joint}: too many protective stops", is_violation=True)
        self.journal.safety(safety)

    def post(self, event: Event) -> None:
        """Let an event happen at the end of the programs' slice."""
        self.posted.append(event)
