"""Ctrl-C and SIGTERM: the first asks for a stop at the epoch's end, with its evaluations; the second stops at once."""

import signal
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any, Self

__all__ = ["StopRequest"]

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopRequest:
    """While entered, turns the first signal into a request; a second one raises KeyboardInterrupt."""

    def __init__(self, report: Callable[[str], None] = lambda _: None) -> None:
        self._report = report
        self._previous: dict[signal.Signals, Any] = {}
        self.is_made = False

    def __call__(self) -> bool:
        """Whether a stop was asked for."""
        return self.is_made

    def __enter__(self) -> Self:
        self._previous = {number: signal.signal(number, self._hear) for number in SIGNALS}
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for number, previous in self._previous.items():
            signal.signal(number, previous)

    def _hear(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002
        if self.is_made:
            raise KeyboardInterrupt
        self.is_made = True
        self._report(
            "stopping after this epoch and the evaluations that are due or under way "
            "(once more: at once, losing what came after the last checkpoint)"
        )
