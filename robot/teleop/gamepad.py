"""A gamepad by SDL's controller mapping (pygame-ce): the same sticks and buttons on every make. The edge."""

import os
from collections.abc import Callable
from importlib import import_module
from typing import Any

from robot.errors import WireError
from robot.teleop.axes import Buttons, Switches, beyond_dead_zone
from robot.teleop.device import DriverInput, missing_extra

__all__ = ["Gamepad"]

FULL = 32767.0


class Gamepad:
    """Implements Device with the first gamepad that SDL knows.

    Args:
        detail: number of the gamepad, 0 where empty.
        now_ns: the driver's time.
        step_s: how long it is between two looks; a gamepad does not mind.
    """

    name = "gamepad"
    keys = (
        ("hold LB", "move"),
        ("left stick", "x, y"),
        ("right stick", "z, turn"),
        ("A/B", "hand"),
        ("up/down", "speed"),
        ("Y", "frame"),
        ("hold RB", "clutch"),
        ("start", "end"),
    )

    def __init__(self, *, detail: str, now_ns: Callable[[], int], step_s: float) -> None:
        del step_s
        self._number = int(detail) if detail.isdigit() else 0
        self._now_ns = now_ns
        self._pygame: Any = None
        self._pad: Any = None
        self._switches = Switches()

    def connect(self) -> None:
        """Open the gamepad.

        Raises:
            MissingExtraError: pygame-ce is not installed.
            WireError: there is no gamepad.
        """
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
        os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # no window: SDL's event queue is all that is needed
        try:
            pygame = import_module("pygame")
            controllers = import_module("pygame._sdl2.controller")
        except ImportError as error:
            raise missing_extra(self.name, "pygame-ce") from error
        pygame.display.init()
        controllers.init()
        if controllers.get_count() <= self._number:
            pygame.display.quit()
            raise WireError(
                f"device gamepad: expected gamepad {self._number}, {controllers.get_count()} are plugged in"
            )
        self._pygame, self._pad = pygame, controllers.Controller(self._number)

    def read(self) -> DriverInput:
        """Return what the gamepad says now; one that was unplugged lets go of everything."""
        pygame, pad = self._pygame, self._pad
        pygame.event.pump()
        if not pad.attached():
            return self._switches.asked(Buttons(over=True), stamp_ns=self._now_ns(), linear=_NONE, angular=_NONE)

        def axis(name: str) -> float:
            return beyond_dead_zone(pad.get_axis(getattr(pygame, f"CONTROLLER_AXIS_{name}")) / FULL)

        def is_down(name: str) -> bool:
            return bool(pad.get_button(getattr(pygame, f"CONTROLLER_BUTTON_{name}")))

        buttons = Buttons(
            deadman=is_down("LEFTSHOULDER"), clutch=is_down("RIGHTSHOULDER"), close=is_down("A"), open=is_down("B"),
            frame=is_down("Y"), faster=is_down("DPAD_UP"), slower=is_down("DPAD_DOWN"), over=is_down("START"),
        )  # fmt: skip
        return self._switches.asked(
            buttons,
            stamp_ns=self._now_ns(),
            linear=(-axis("LEFTY"), -axis("LEFTX"), -axis("RIGHTY")),
            angular=(0.0, 0.0, -axis("RIGHTX")),
        )

    def close(self) -> None:
        """Give the gamepad back. Idempotent, never raises."""
        pad, self._pad = self._pad, None
        if pad is not None:
            pad.quit()
            self._pygame.display.quit()


_NONE = (0.0, 0.0, 0.0)
