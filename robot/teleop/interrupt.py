"""Signals that end a drive: the arm comes to rest first, and the terminal is given back. The edge."""

import signal
from types import FrameType, TracebackType
from typing import Any, Self

__all__ = ["EndRequest"]

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, a polite kill, and a terminal or an SSH connection that went away."""


class EndRequest:
    """While entered, turns the first signal into a request; a second Ctrl-C raises KeyboardInterrupt."""

    def __init__(self) -> None:
        self._previous: dict[signal.Signals, Any] = {}
        self._is_made = False

    def __call__(self) -> bool:
        """Whether an end was asked for."""
        return self._is_made

    def __enter__(self) -> Self:
        self._previous = {number: signal.signal(number, self._hear) for number in SIGNALS}
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for number, previous in self._previous.items():
            signal.signal(number, previous)

    def _hear(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002
        if self._is_made and number == signal.SIGINT:
            raise KeyboardInterrupt
        self._is_made = True
