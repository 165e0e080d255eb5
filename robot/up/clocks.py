"""How far the clocks of other processes are off, by what they answer to pings. State, and the thread that asks.

An answer tells the other clock half a round trip ago, give or take that half. Clocks part with time: an estimate that
is older is worth less, and the best is the one whose bound is narrowest now. Nothing is judged by it: deadlines go by
one machine's clock, and what came from another counts from its arrival.
"""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from threading import Event, Thread
from time import monotonic_ns

import msgspec

from robot.bus.errors import BusError
from robot.bus.session import Bus
from robot.bus.watch import Answer, ping_all

__all__ = ["DRIFT", "ClockAsker", "ClockBook", "ClockOffset"]

DRIFT = 2e-4
"""Two clocks part by less than this share of the time that passes."""
N_KEPT = 16
GONE_S, ASK_S = 30.0, 2.0


class ClockOffset(msgspec.Struct, frozen=True, kw_only=True):
    """One process's clock."""

    source: str
    is_same_clock: bool
    """It goes by this machine's."""
    offset_ms: float
    """Its clock less ours."""
    within_ms: float
    """It may be off by so much."""


class ClockBook:
    """Keeps the newest answers of each process.

    Args:
        now_ns: this process's monotonic clock.
    """

    def __init__(self, *, now_ns: Callable[[], int] = monotonic_ns) -> None:
        self._now_ns = now_ns
        self._answers: dict[str, deque[tuple[int, Answer]]] = {}

    def take(self, answers: tuple[Answer, ...]) -> None:
        """Take in what came to one ping, now. A process on another machine than before is another one."""
        now_ns = self._now_ns()
        for answer in answers:
            kept = self._answers.setdefault(answer.source, deque(maxlen=N_KEPT))
            if kept and (kept[-1][1].is_same_clock != answer.is_same_clock or self._has_jumped(*kept[-1], answer)):
                kept.clear()
            kept.append((now_ns, answer))

    def offsets(self) -> tuple[ClockOffset, ...]:
        """Return each process's, as far as it answered lately, by name."""
        found = []
        for source, kept in sorted(self._answers.copy().items()):
            told = list(kept)
            if self._now_ns() - told[-1][0] > GONE_S * 1e9:
                continue
            within_ms, offset_ms = min((self._within_ms(at_ns, a), a.offset_ms) for at_ns, a in told)
            found.append(
                ClockOffset(
                    source=source, is_same_clock=told[-1][1].is_same_clock, offset_ms=offset_ms, within_ms=within_ms
                )
            )  # fmt: skip
        return tuple(found)

    def _within_ms(self, at_ns: int, answer: Answer) -> float:
        return answer.offset_within_ms + DRIFT * (self._now_ns() - at_ns) / 1e6

    def _has_jumped(self, at_ns: int, before: Answer, answer: Answer) -> bool:
        """Whether no clock that runs could have told both: its machine was started anew."""
        return abs(answer.offset_ms - before.offset_ms) > self._within_ms(at_ns, before) + answer.offset_within_ms


class ClockAsker:
    """Pings everybody every two seconds, from a thread of its own: one that does not answer holds nobody up.

    Args:
        bus: open.
        book: takes the answers.
    """

    def __init__(self, bus: Bus, book: ClockBook) -> None:
        self._bus, self._book, self._is_over = bus, book, Event()
        self._thread = Thread(target=self._run, name="clocks", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ask no more. Idempotent."""
        self._is_over.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._is_over.wait(ASK_S):
            with suppress(BusError):  # somebody answers nonsense, or the hub is gone: there is a next time
                self._book.take(ping_all(self._bus))
