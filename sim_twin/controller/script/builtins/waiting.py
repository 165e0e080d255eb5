"""What takes time without a robot: sync, sleep, and messages that wait to be read."""

import math
from collections.abc import Generator
from typing import Protocol

import msgspec

from sim_twin.controller.script.builtins.arguments import flag, number
from sim_twin.controller.script.code import Builtins
from sim_twin.controller.script.values import Value, shown, text_of

__all__ = ["Messages", "Popup", "message_builtins", "slices_in", "time_builtins"]


class Popup(msgspec.Struct, frozen=True, kw_only=True):
    """What the script wants a person to read."""

    text: str
    title: str
    is_warning: bool
    is_error: bool
    is_blocking: bool


class Messages(Protocol):
    """Where a script's messages go."""

    def log(self, text: str) -> None:
        """Take a line for the log."""
        ...

    def show(self, popup: Popup) -> None:
        """Open a popup."""
        ...

    def is_popup_open(self) -> bool:
        """Return whether a popup has not been closed yet; a blocking one is waited for."""
        ...


def slices_in(duration_s: float, slice_s: float) -> int:
    """Return how many slices cover a duration; a millionth of a slice too many is none."""
    if not math.isfinite(duration_s):
        raise ValueError(f"expected a finite time in seconds, got {duration_s}")
    return max(0, math.ceil(duration_s / slice_s - 1e-6))


def time_builtins(*, slice_s: float) -> Builtins:
    """Return sync, sleep and get_steptime for slices of a length."""

    def sync() -> Generator[None, None, Value]:
        yield

    def sleep(t: Value) -> Generator[None, None, Value]:
        for _ in range(slices_in(number(t), slice_s)):
            yield

    def get_steptime() -> Value:
        return slice_s

    return {"sync": sync, "sleep": sleep, "get_steptime": get_steptime}


def message_builtins(messages: Messages) -> Builtins:
    """Return textmsg and popup for a host that shows messages."""

    def textmsg(s1: Value, s2: Value = "") -> Value:
        messages.log(shown(text_of(s1) + text_of(s2)))

    def popup(
        s: Value, title: Value = "Popup", warning: Value = False, error: Value = False, blocking: Value = False
    ) -> Generator[None, None, Value]:
        is_blocking = flag(blocking)
        messages.show(
            Popup(
                text=shown(text_of(s)),
                title=shown(text_of(title)),
                is_warning=flag(warning),
                is_error=flag(error),
                is_blocking=is_blocking,
            )
        )
        while is_blocking and messages.is_popup_open():
            yield

    return {"textmsg": textmsg, "popup": popup}
