"""Signals that ask a long job to end: the first is a request, so that an arm rests and nothing is lost. The edge."""

import signal
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any, Self

__all__ = ["StopRequest"]


class StopRequest:
    """While entered, turns the first signal into a request; one more of those that end at once raises.

    Args:
        report: Told of the first.
        signals: What asks: Ctrl-C and a polite kill where nothing else is said.
        at_once: Of which the next raises KeyboardInterrupt; others go on asking.
    """

    def __init__(
        self,
        report: Callable[[], object] = lambda: None,
        *,
        signals: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM),
        at_once: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM),
    ) -> None:
        self._report, self._signals, self._at_once = report, signals, at_once
        self._previous: dict[signal.Signals, Any] = {}
        self._is_made = False

    def __call__(self) -> bool:
        """Whether a stop was asked for."""
        return self._is_made

    def __enter__(self) -> Self:
        self._previous = {number: signal.signal(number, self._hear) for number in self._signals}
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for number, previous in self._previous.items():
            signal.signal(number, previous)

    def _hear(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002
        if self._is_made and number in self._at_once:
            raise KeyboardInterrupt
        if not self._is_made:
            self._is_made = True
            self._report()
