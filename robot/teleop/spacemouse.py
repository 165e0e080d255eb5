"""A SpaceMouse (pyspacemouse): the puck springs back, so that pushing it is holding. The edge."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from robot.errors import WireError
from robot.teleop.axes import Buttons, Switches, beyond_dead_zone
from robot.teleop.device import DriverInput, missing_extra

__all__ = ["SpaceMouse"]

MOST_REPORTS = 32
"""Reports read at one look: a puck sends some 125 a second."""


class SpaceMouse:
    """Implements Device with the first SpaceMouse found. Axes as a person sits behind the arm: away, left, up.

    Args:
        detail: name of the model, any where empty.
        now_ns: the driver's time.
        step_s: how long it is between two looks; a puck does not mind.
    """

    name = "spacemouse"
    keys = (("push", "x, y, z"), ("twist", "turn"), ("left/right button", "hand closes/opens"), ("Ctrl-C", "end"))

    def __init__(self, *, detail: str, now_ns: Callable[[], int], step_s: float) -> None:
        del step_s
        self._model = detail or None
        self._now_ns = now_ns
        self._puck: Any = None
        self._switches = Switches()
        self._told_s, self._told_ns = -1.0, 0

    def connect(self) -> None:
        """Open the puck.

        Raises:
            MissingExtraError: pyspacemouse is not installed.
            WireError: there is none, or the system's HID library does not let it be opened.
        """
        try:
            library = import_module("pyspacemouse")
        except ImportError as error:
            raise missing_extra(self.name, "pyspacemouse") from error
        try:
            self._puck = library.open(device=self._model, axis_convention=library.AxisConvention.ROS)
        except (RuntimeError, ValueError, OSError, ImportError, AttributeError) as error:
            raise WireError(f"device spacemouse: expected one that may be opened, {error}") from error
        self._told_ns = self._now_ns()

    def read(self) -> DriverInput:
        """Return what the puck says now; one that was unplugged lets go of everything.

        While it is pushed it reports all the time: a push of which nothing new is heard grows old.
        """
        now_ns = self._now_ns()
        try:
            state = self._newest()
        except (OSError, RuntimeError):
            return self._switches.asked(Buttons(over=True), stamp_ns=now_ns, linear=_NONE, angular=_NONE)
        linear = tuple(beyond_dead_zone(share) for share in (state.x, state.y, state.z))
        angular = tuple(beyond_dead_zone(share) for share in (state.roll, state.pitch, state.yaw))
        is_pushed = any((*linear, *angular))
        if state.t != self._told_s or not is_pushed:
            self._told_s, self._told_ns = state.t, now_ns
        left, right, *_ = (*state.buttons, 0, 0)
        return self._switches.asked(
            Buttons(deadman=is_pushed, close=bool(left), open=bool(right)),
            stamp_ns=self._told_ns,
            linear=(linear[0], linear[1], linear[2]),
            angular=(angular[0], angular[1], angular[2]),
        )

    def close(self) -> None:
        """Give the puck back. Idempotent, never raises."""
        puck, self._puck = self._puck, None
        if puck is not None:
            puck.close()

    def _newest(self) -> Any:  # noqa: ANN401 - the library's own
        state = self._puck.read()
        for _ in range(MOST_REPORTS):
            told_s, state = state.t, self._puck.read()
            if state.t == told_s:
                break
        return state


_NONE = (0.0, 0.0, 0.0)
