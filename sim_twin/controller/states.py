"""Words of the controller's modes: what it can be, what can happen to it, what must be done."""

from enum import Enum, IntEnum, auto

import msgspec

__all__ = [
    "Condition",
    "Event",
    "MotionOrder",
    "PowerTimes",
    "ProgramOrder",
    "Reaction",
    "RobotMode",
    "RuntimeState",
    "SafetyMode",
    "StopCategory",
]


class RobotMode(IntEnum):
    """RTDE's robot_mode."""

    NO_CONTROLLER = -1
    DISCONNECTED = 0
    CONFIRM_SAFETY = 1
    BOOTING = 2
    POWER_OFF = 3
    POWER_ON = 4
    IDLE = 5
    BACKDRIVE = 6
    RUNNING = 7
    UPDATING = 8


class SafetyMode(IntEnum):
    """RTDE's safety_mode."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    RECOVERY = 4
    SAFEGUARD_STOP = 5
    SYSTEM_EMERGENCY_STOP = 6
    ROBOT_EMERGENCY_STOP = 7
    VIOLATION = 8
    FAULT = 9


class RuntimeState(IntEnum):
    """RTDE's runtime_state."""

    STOPPING = 0
    STOPPED = 1
    PLAYING = 2
    PAUSING = 3
    PAUSED = 4
    RESUMING = 5


class StopCategory(IntEnum):
    """IEC 60204-1: 0 cuts the drives, 1 slows down and then cuts them and brakes, 2 slows down and holds by power."""

    CUT = 0
    STOP_THEN_CUT = 1
    STOP_AND_HOLD = 2


class Event(Enum):
    """What happens to a controller."""

    POWER_ON = auto()
    POWER_OFF = auto()
    BRAKE_RELEASE = auto()
    PLAY = auto()
    PAUSE = auto()
    STOP = auto()
    PROGRAM_ENDED = auto()
    PROTECTIVE_STOP = auto()
    UNLOCK_PROTECTIVE_STOP = auto()
    SAFEGUARD_OPENED = auto()
    SAFEGUARD_CLOSED = auto()
    SAFEGUARD_RESET = auto()
    ROBOT_ESTOP = auto()
    ROBOT_ESTOP_RELEASED = auto()
    SYSTEM_ESTOP = auto()
    SYSTEM_ESTOP_RELEASED = auto()
    VIOLATION = auto()
    FAULT = auto()
    RESTART_SAFETY = auto()
    REDUCED = auto()
    REDUCED_ENDED = auto()
    RECOVERY = auto()
    """The arm has power beyond its limits."""
    RECOVERED = auto()


class MotionOrder(Enum):
    """What the drive must do."""

    NONE = auto()
    CUT = auto()
    """Cut the servos' power, brakes in, moving or not."""
    STOP = auto()
    """Slow down as fast as the arm may, off the path if need be, and hold."""
    PAUSE = auto()
    """Slow down on the path and hold; what knows no path is braked, what complies ends."""
    RESUME = auto()
    """Go on along the path."""
    ENGAGE = auto()
    """Power to the servos, brakes out."""


class ProgramOrder(Enum):
    """What the program must do."""

    NONE = auto()
    START = auto()
    STOP = auto()
    PAUSE = auto()
    RESUME = auto()


class Reaction(msgspec.Struct, frozen=True, kw_only=True):
    """Answer to an event."""

    motion: MotionOrder = MotionOrder.NONE
    program: ProgramOrder = ProgramOrder.NONE
    category: StopCategory | None = None
    refusal: str | None = None
    """Why nothing happened."""


class PowerTimes(msgspec.Struct, frozen=True, kw_only=True):
    """How long the arm takes, in slices of 2 ms."""

    n_power_on: int = 1000
    n_brake_release: int = 500
    n_stop_at_most: int = 250
    """An emergency stop cuts the drives after this, standing or not."""
    n_before_unlock: int = 2500
    """UR: 5 s."""
    n_stops_span: int = 8 * 3600 * 500
    """UR: more than 50 protective stops of a joint in 8 h are a fault (C163)."""


class Condition(Enum):
    """What keeps a robot from being normal; the first that holds is the safety mode."""

    FAULT = (SafetyMode.FAULT, 9)
    VIOLATION = (SafetyMode.VIOLATION, 8)
    SYSTEM_ESTOP = (SafetyMode.SYSTEM_EMERGENCY_STOP, 5)
    ROBOT_ESTOP = (SafetyMode.ROBOT_EMERGENCY_STOP, 6)
    SAFEGUARD = (SafetyMode.SAFEGUARD_STOP, 4)
    PROTECTIVE = (SafetyMode.PROTECTIVE_STOP, 2)
    RECOVERY = (SafetyMode.RECOVERY, 3)
    REDUCED = (SafetyMode.REDUCED, 1)
