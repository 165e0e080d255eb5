"""The controller's modes: power, safety, program. A state machine in tables; it knows slices, no clock.

Every event is answered by a reaction: what the motion and the program must do, or why nothing happens.
"""

from collections import deque

import msgspec

from sim_twin.controller.states import (
    Condition,
    Event,
    MotionOrder,
    PowerTimes,
    ProgramOrder,
    Reaction,
    RobotMode,
    RuntimeState,
    SafetyMode,
    StopCategory,
)

__all__ = [
    "Condition",
    "Event",
    "Modes",
    "MotionOrder",
    "PowerTimes",
    "ProgramOrder",
    "Reaction",
    "RobotMode",
    "RuntimeState",
    "SafetyMode",
    "StopCategory",
]


_NONE = Reaction()
_ESTOPS = (Condition.SYSTEM_ESTOP, Condition.ROBOT_ESTOP)
_POWERLESS = (Condition.FAULT, Condition.VIOLATION, *_ESTOPS)
_STOPS = (*_POWERLESS, Condition.SAFEGUARD, Condition.PROTECTIVE)
_OFF_PATH = (*_POWERLESS, Condition.PROTECTIVE)
_ESTOP_BIT, _STOPPED_BIT = 7, 10
N_STOPS_A_JOINT = 50

_CUT = Reaction(motion=MotionOrder.CUT, program=ProgramOrder.STOP, category=StopCategory.CUT)
_EMERGENCY = Reaction(motion=MotionOrder.STOP, program=ProgramOrder.STOP, category=StopCategory.STOP_THEN_CUT)
_PROTECT = Reaction(motion=MotionOrder.STOP, program=ProgramOrder.PAUSE, category=StopCategory.STOP_AND_HOLD)
_GUARD = Reaction(motion=MotionOrder.PAUSE, program=ProgramOrder.PAUSE, category=StopCategory.STOP_AND_HOLD)
_RAISES: dict[Event, tuple[Condition, Reaction]] = {
    Event.FAULT: (Condition.FAULT, _CUT),
    Event.VIOLATION: (Condition.VIOLATION, _CUT),
    Event.SYSTEM_ESTOP: (Condition.SYSTEM_ESTOP, _EMERGENCY),
    Event.ROBOT_ESTOP: (Condition.ROBOT_ESTOP, _EMERGENCY),
    Event.SAFEGUARD_OPENED: (Condition.SAFEGUARD, _GUARD),
    Event.PROTECTIVE_STOP: (Condition.PROTECTIVE, _PROTECT),
    Event.REDUCED: (Condition.REDUCED, _NONE),
    Event.RECOVERY: (Condition.RECOVERY, _NONE),
}
_RELEASES = {
    Event.SYSTEM_ESTOP_RELEASED: Condition.SYSTEM_ESTOP,
    Event.ROBOT_ESTOP_RELEASED: Condition.ROBOT_ESTOP,
    Event.REDUCED_ENDED: Condition.REDUCED,
    Event.RECOVERED: Condition.RECOVERY,
}


class _Command(msgspec.Struct, frozen=True, kw_only=True):
    """One row: where a command is allowed and what it leads to."""

    modes: tuple[RobotMode, ...]
    runtimes: tuple[RuntimeState, ...] = tuple(RuntimeState)
    forbidden_by: tuple[Condition, ...] = ()
    to_runtime: RuntimeState | None = None
    reaction: Reaction = _NONE


_ALL = tuple(RobotMode)
_UNPOWERED = (RobotMode.POWER_OFF, RobotMode.POWER_ON, RobotMode.IDLE)
_ALIVE = (RuntimeState.PLAYING, RuntimeState.PAUSING, RuntimeState.PAUSED, RuntimeState.RESUMING)
_COMMANDS: dict[Event, tuple[_Command, ...]] = {
    Event.POWER_ON: (_Command(modes=(RobotMode.POWER_OFF,), forbidden_by=_POWERLESS),),
    Event.BRAKE_RELEASE: (_Command(modes=_UNPOWERED, forbidden_by=_POWERLESS),),
    Event.POWER_OFF: (_Command(modes=_ALL, reaction=_CUT),),
    Event.PLAY: (
        _Command(
            modes=(RobotMode.RUNNING,), runtimes=(RuntimeState.STOPPED,), forbidden_by=_STOPS,
            to_runtime=RuntimeState.PLAYING,
            reaction=Reaction(motion=MotionOrder.RESUME, program=ProgramOrder.START),
        ),
        _Command(
            modes=(RobotMode.RUNNING,), runtimes=(RuntimeState.PAUSED,), forbidden_by=_STOPS,
            to_runtime=RuntimeState.RESUMING,
            reaction=Reaction(motion=MotionOrder.RESUME, program=ProgramOrder.RESUME),
        ),
    ),
    Event.PAUSE: (
        _Command(
            modes=_ALL, runtimes=(RuntimeState.PLAYING, RuntimeState.RESUMING), to_runtime=RuntimeState.PAUSING,
            reaction=_GUARD,
        ),
    ),
    Event.STOP: (
        _Command(
            modes=_ALL, runtimes=_ALIVE, to_runtime=RuntimeState.STOPPING,
            reaction=Reaction(
                motion=MotionOrder.STOP, program=ProgramOrder.STOP, category=StopCategory.STOP_AND_HOLD
            ),
        ),
    ),
    Event.PROGRAM_ENDED: (
        _Command(modes=_ALL, runtimes=(*_ALIVE, RuntimeState.STOPPING), to_runtime=RuntimeState.STOPPING),
    ),
}  # fmt: skip
_AFTER_STANDING = {
    RuntimeState.STOPPING: RuntimeState.STOPPED,
    RuntimeState.PAUSING: RuntimeState.PAUSED,
}
_RUNTIME_ON = {ProgramOrder.STOP: RuntimeState.STOPPING, ProgramOrder.PAUSE: RuntimeState.PAUSING}


class Modes:
    """Robot mode, safety mode and runtime state of one controller.

    Args:
        times: How long things take.
        needs_safeguard_reset: See there.

    Attributes:
        needs_safeguard_reset: A safeguard that closes waits for its reset; otherwise the program resumes by itself.
        robot: Robot mode.
        runtime: State of the program.
        is_remote: Remote control is on; who serves remote commands asks.
    """

    TOO_EARLY = (
        "Cannot unlock protective stop until 5s after occurrence. "
        "Always inspect cause of protective stop before unlocking"
    )

    def __init__(self, *, times: PowerTimes | None = None, needs_safeguard_reset: bool = False) -> None:
        self.times = times or PowerTimes()
        self.needs_safeguard_reset = needs_safeguard_reset
        self.robot = RobotMode.POWER_OFF
        self.runtime = RuntimeState.STOPPED
        self.is_remote = True
        self._conditions: set[Condition] = set()
        self._n_slices = 0
        self._due: int | None = None
        self._wants_running = False
        self._cut_at: int | None = None
        self._protected_at = 0
        self._is_guard_open = self._was_playing = False
        self._stops: dict[int | None, deque[int]] = {}

    # ------------------------------------------------------------------------------------------------ what it is

    @property
    def safety(self) -> SafetyMode:
        """The gravest condition that holds."""
        if not self._conditions:
            return SafetyMode.NORMAL
        return next(c.value[0] for c in Condition if c in self._conditions)

    @property
    def is_stopped_by_safety(self) -> bool:
        """A stop holds: no program may move the arm."""
        return bool(self._conditions) and any(c in self._conditions for c in _STOPS)

    @property
    def is_reduced(self) -> bool:
        """Reduced limits hold."""
        return Condition.REDUCED in self._conditions

    @property
    def is_recovering(self) -> bool:
        """The arm is beyond its limits: it is moved by hand only."""
        return Condition.RECOVERY in self._conditions

    @property
    def may_move(self) -> bool:
        """Motions of a program are to be resumed in this slice."""
        is_running = self.robot is RobotMode.RUNNING and not self._stops_off_path()
        return is_running and self.runtime in (RuntimeState.PLAYING, RuntimeState.PAUSING, RuntimeState.RESUMING)

    @property
    def robot_status_bits(self) -> int:
        """RTDE's bits: 0 power on, 1 program running (2 teach button and 3 power button are never pressed)."""
        is_powered = self.robot in (RobotMode.POWER_ON, RobotMode.IDLE, RobotMode.BACKDRIVE, RobotMode.RUNNING)
        is_alive = self.runtime in _ALIVE
        return int(is_powered) | int(is_alive) << 1

    @property
    def safety_status_bits(self) -> int:
        """RTDE's bits 0 to 10."""
        if not self._conditions:
            return 1
        bits = sum(1 << c.value[1] for c in self._conditions)
        if any(c in self._conditions for c in _ESTOPS):
            bits |= 1 << _ESTOP_BIT
        return bits | int(self.is_stopped_by_safety) << _STOPPED_BIT

    def _stops_off_path(self) -> bool:
        return bool(self._conditions) and any(c in self._conditions for c in _OFF_PATH)

    # -------------------------------------------------------------------------------------------------- what happens

    def handle(self, event: Event, *, joint: int | None = None) -> Reaction:
        """Take in an event and return what must be done.

        Args:
            event: What happened.
            joint: Of a protective stop, where one joint is to blame: too many in 8 h are a fault.
        """
        if event in _RAISES:
            return self._raise(event, joint)
        if event in _RELEASES:
            return self._release(_RELEASES[event])
        if event in _COMMANDS:
            return self._command(event)
        return {
            Event.UNLOCK_PROTECTIVE_STOP: self._unlock,
            Event.SAFEGUARD_CLOSED: self._close_guard,
            Event.SAFEGUARD_RESET: self._reset_guard,
            Event.RESTART_SAFETY: self._restart,
        }[event]()

    def tick(self, *, is_standing: bool) -> Reaction:
        """Let one slice pass and return what is due.

        Args:
            is_standing: The arm is at rest.
        """
        self._n_slices += 1
        if self._cut_at is not None and (is_standing or self._n_slices >= self._cut_at):
            return self._lose_power()
        if is_standing or self.robot is not RobotMode.RUNNING:
            self.runtime = _AFTER_STANDING.get(self.runtime, self.runtime)
        if self.runtime is RuntimeState.RESUMING:
            self.runtime = RuntimeState.PLAYING
        elif self._was_playing and self.runtime is RuntimeState.PAUSED and not self.is_stopped_by_safety:
            return self._resume()
        if self._due is not None and self._n_slices >= self._due:
            return self._come_up()
        return _NONE

    def _raise(self, event: Event, joint: int | None) -> Reaction:
        condition, reaction = _RAISES[event]
        if condition is Condition.PROTECTIVE and self._is_worn_out(joint):
            return self._raise(Event.FAULT, None)
        is_new = condition not in self._conditions
        self._conditions.add(condition)
        if condition is Condition.PROTECTIVE and is_new:
            self._protected_at = self._n_slices
        if condition is Condition.SAFEGUARD:
            self._is_guard_open = True
            self._was_playing |= self.runtime in (RuntimeState.PLAYING, RuntimeState.RESUMING)
        elif condition in _STOPS:
            # Only a person goes on after any other stop, whatever it was that paused the program first.
            self._was_playing = False
        if reaction.category is StopCategory.CUT:
            self._power_off()
        elif reaction.category is StopCategory.STOP_THEN_CUT and self.robot is not RobotMode.POWER_OFF:
            self._cut_at = self._cut_at or self._n_slices + self.times.n_stop_at_most
        return self._obeyed(reaction)

    def _obeyed(self, reaction: Reaction) -> Reaction:
        """Bring the program's state where the reaction's order leads it."""
        if reaction.program in _RUNTIME_ON and self.runtime in _ALIVE:
            is_paused_already = reaction.program is ProgramOrder.PAUSE and self.runtime is RuntimeState.PAUSED
            if not is_paused_already:
                self.runtime = _RUNTIME_ON[reaction.program]
        return reaction

    def _release(self, condition: Condition) -> Reaction:
        if condition not in self._conditions:
            return Reaction(refusal=f"{condition.name.lower()}: not active, nothing to release")
        self._conditions.discard(condition)
        # A button that is let go before the arm stood leaves no power either.
        return self._lose_power() if condition in _ESTOPS and self._cut_at is not None else _NONE

    def _command(self, event: Event) -> Reaction:
        if event in (Event.PAUSE, Event.STOP):
            self._was_playing = False
        rows = _COMMANDS[event]
        row = next((r for r in rows if self.robot in r.modes and self.runtime in r.runtimes), None)
        if row is None:
            return Reaction(
                refusal=f"{event.name.lower()}: not possible in mode {self.robot.name}, program {self.runtime.name}"
            )
        if any(c in self._conditions for c in row.forbidden_by):
            return Reaction(refusal=f"{event.name.lower()}: not possible in safety mode {self.safety.name}")
        if row.to_runtime is not None:
            self.runtime = row.to_runtime
        if event in (Event.POWER_ON, Event.BRAKE_RELEASE):
            self._start_power(event)
        elif event is Event.POWER_OFF:
            self._power_off()
        return self._obeyed(row.reaction)

    def _start_power(self, event: Event) -> None:
        self._wants_running |= event is Event.BRAKE_RELEASE
        if self.robot is RobotMode.POWER_OFF:
            self.robot = RobotMode.POWER_ON
            self._due = self._n_slices + self.times.n_power_on
        elif self.robot is RobotMode.IDLE and self._due is None:
            self._due = self._n_slices + self.times.n_brake_release

    def _come_up(self) -> Reaction:
        self._due = None
        if self.robot is RobotMode.POWER_ON:
            self.robot = RobotMode.IDLE
            if self._wants_running:
                self._due = self._n_slices + self.times.n_brake_release
            return _NONE
        self.robot, self._wants_running = RobotMode.RUNNING, False
        return Reaction(motion=MotionOrder.ENGAGE)

    def _power_off(self) -> None:
        self.robot = RobotMode.POWER_OFF
        self._conditions.discard(Condition.RECOVERY)
        self._due, self._cut_at, self._wants_running, self._was_playing = None, None, False, False

    def _lose_power(self) -> Reaction:
        self._power_off()
        return Reaction(motion=MotionOrder.CUT, category=StopCategory.CUT)

    def _unlock(self) -> Reaction:
        if Condition.PROTECTIVE not in self._conditions:
            return Reaction(refusal="unlock protective stop: there is none")
        if self._n_slices - self._protected_at < self.times.n_before_unlock:
            return Reaction(refusal=self.TOO_EARLY)
        self._conditions.discard(Condition.PROTECTIVE)
        return _NONE

    def _close_guard(self) -> Reaction:
        self._is_guard_open = False
        return _NONE if self.needs_safeguard_reset else self._clear_guard()

    def _reset_guard(self) -> Reaction:
        if self._is_guard_open:
            return Reaction(refusal="safeguard reset: the safeguard is open; close it first")
        return self._clear_guard()

    def _clear_guard(self) -> Reaction:
        """Go on where the safeguard alone paused a program; one that is still slowing down comes to rest first."""
        self._conditions.discard(Condition.SAFEGUARD)
        if self.runtime in (RuntimeState.STOPPED, RuntimeState.STOPPING):
            self._was_playing = False
            return Reaction(motion=MotionOrder.RESUME)
        if not self._was_playing or self.is_stopped_by_safety or self.runtime is not RuntimeState.PAUSED:
            return _NONE
        return self._resume()

    def _resume(self) -> Reaction:
        self._was_playing = False
        self.runtime = RuntimeState.RESUMING
        return Reaction(motion=MotionOrder.RESUME, program=ProgramOrder.RESUME)

    def _restart(self) -> Reaction:
        if any(c in self._conditions for c in _ESTOPS):
            return Reaction(refusal="restart safety: release the emergency stop first")
        self._conditions -= {Condition.FAULT, Condition.VIOLATION, Condition.PROTECTIVE}
        self._power_off()
        return self._obeyed(_CUT)

    def _is_worn_out(self, joint: int | None) -> bool:
        if joint is None:
            return False
        stops = self._stops.setdefault(joint, deque())
        stops.append(self._n_slices)
        while self._n_slices - stops[0] > self.times.n_stops_span:
            stops.popleft()
        return len(stops) > N_STOPS_A_JOINT
