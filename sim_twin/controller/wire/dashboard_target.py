"""What the dashboard server needs of the robot behind it."""

from collections.abc import Callable
from enum import Enum
from typing import Protocol, TypeAlias

import msgspec

__all__ = ["Awaited", "DashboardStatus", "DashboardTarget", "Outcome", "PanelTarget", "PowerTarget", "ProgramTarget"]


class Outcome(Enum):
    """How a request ended."""

    DONE = "done"
    FAILED = "failed"
    NOT_FOUND = "not found"
    TOO_EARLY = "too early"


Awaited: TypeAlias = Callable[[], Outcome | None]
"""Asked again and again, it returns how a request ended, None until that is known."""


class DashboardStatus(msgspec.Struct, frozen=True, kw_only=True):
    """What the queries tell, in the dashboard's own words.

    Attributes:
        robot_mode: POWER_OFF, IDLE, RUNNING, ...
        safety_mode: NORMAL, REDUCED, PROTECTIVE_STOP, ... as `safetymode` says it.
        safety_status: The finer `safetystatus`, such as AUTOMATIC_MODE_SAFEGUARD_STOP.
        program_state: STOPPED, PLAYING or PAUSED.
        program: The loaded program's path; None while none is loaded.
        is_running: Whether a program executes, uploaded scripts included.
        is_program_saved: Whether the loaded program has no unsaved changes.
        is_remote: Whether the pendant stands on remote control.
        operational_mode: NONE, MANUAL or AUTOMATIC.
        robot_model: UR3, UR5, UR10, ... without the e.
        serial_number: Digits, starting with the year.
        build_date: In brackets after the version, such as Dec 12 2024.
    """

    robot_mode: str
    safety_mode: str
    safety_status: str
    program_state: str
    program: str | None
    is_running: bool
    is_program_saved: bool = True
    is_remote: bool = True
    operational_mode: str = "NONE"
    robot_model: str = "UR5"
    serial_number: str = "20215501234"
    build_date: str = "Dec 01 2021"


class PowerTarget(Protocol):
    """Power, brakes and safety."""

    def power_on(self) -> Outcome:
        """Power the arm; it comes to IDLE."""
        ...

    def power_off(self) -> Outcome:
        """Take the arm's power."""
        ...

    def brake_release(self) -> Outcome:
        """Open the brakes; the arm comes to RUNNING, by way of power on if need be."""
        ...

    def unlock_protective_stop(self) -> Outcome:
        """Leave a protective stop; TOO_EARLY in the first 5 s."""
        ...

    def close_safety_popup(self) -> Outcome:
        """Close the safety popup."""
        ...

    def restart_safety(self) -> Outcome:
        """Restart the safety system after a fault or violation; the arm comes to POWER_OFF."""
        ...

    def shutdown(self) -> Outcome:
        """Switch the controller off."""
        ...


class ProgramTarget(Protocol):
    """Programs."""

    def play(self) -> Awaited:
        """Start the loaded program, or resume a paused one; return what tells whether it began."""
        ...

    def stop(self) -> Outcome:
        """Stop whatever program runs."""
        ...

    def pause(self) -> Outcome:
        """Pause the program that runs."""
        ...

    def load(self, path: str) -> Outcome:
        """Load a program; NOT_FOUND where there is none."""
        ...

    def load_installation(self, path: str) -> Outcome:
        """Load an installation; NOT_FOUND where there is none."""
        ...


class PanelTarget(Protocol):
    """The teach pendant's screen and log."""

    def popup(self, text: str) -> Outcome:
        """Show a popup."""
        ...

    def close_popup(self) -> Outcome:
        """Close it."""
        ...

    def add_to_log(self, text: str) -> Outcome:
        """Write a line to the log."""
        ...

    def set_operational_mode(self, mode: str) -> Outcome:
        """Take control of the operational mode: MANUAL or AUTOMATIC."""
        ...

    def clear_operational_mode(self) -> Outcome:
        """Give that control back."""
        ...

    def set_user_role(self, role: str) -> Outcome:
        """Choose the user's role; CB3 only."""
        ...


class DashboardTarget(PowerTarget, ProgramTarget, PanelTarget, Protocol):
    """The robot as the dashboard sees it."""

    def status(self) -> DashboardStatus:
        """Return what holds now."""
        ...
