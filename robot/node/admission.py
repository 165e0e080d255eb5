"""Which commands a robot node lets in: those of the lease in force, in order, and not old. Pure state.

Age is judged by the stamp where source and node have one clock. Otherwise only how much longer a message took than the
fastest lately is known: that needs two clocks to run equally fast, not to agree.
"""

from collections.abc import Callable

__all__ = ["Admission"]

AHEAD_NS = 5_000_000
"""A stamp may be this much ahead of the reader's own clock: two processors of one machine."""
DRIFT = 2e-4
"""Two clocks part by less than this share of the time that passes."""


class Admission:
    """Judges what comes under one lease at a time.

    Args:
        max_age_ns: older is too old.
        now_ns: this process's monotonic clock.

    Attributes:
        lease: that in force; empty where there is none.
        n_refused: how many were not let in.
        refused: why the last of them was not.
    """

    def __init__(self, *, max_age_ns: int, now_ns: Callable[[], int]) -> None:
        self._max_age_ns, self._now_ns = max_age_ns, now_ns
        self.lease = ""
        self._number = 0
        self._fastest_ns: int | None = None
        """The least difference of arrival and stamp, clocks' offset and all."""
        self._fastest_at_ns = 0
        self.n_refused = 0
        self.refused = ""

    def begin(self, lease: str) -> None:
        """Let in what comes under a new lease, and nothing else; nothing at all where it is empty."""
        self.lease, self._number, self._fastest_ns = lease, 0, None

    def refuse(self, why: str) -> str:
        """Count a refusal and return why."""
        self.n_refused += 1
        self.refused = why
        return why

    def is_repeat(self, lease: str, number: int) -> bool:
        """Tell whether this is what was let in last, once more: its answer may be lost."""
        return bool(self.lease) and lease == self.lease and 0 < number == self._number

    def why_not(self, lease: str, number: int, *, stamp_ns: int, age_ns: int | None) -> str | None:
        """Return why a command is not let in, None where it is, and its number is used up.

        Args:
            lease: that it comes under.
            number: its own.
            stamp_ns: by its source's clock.
            age_ns: None where that is not this one's.
        """
        why = self.why_no_turn(lease, number) or self._why_late(stamp_ns, age_ns)
        if why is not None:
            return self.refuse(why)
        self._number = number
        return None

    def why_no_turn(self, lease: str, number: int) -> str | None:
        """Return what is wrong with lease and number; None where nothing is."""
        if not self.lease:
            return "lease: expected one in force, nobody has any: it must be taken"
        if lease != self.lease:
            return "lease: expected the one in force, came another, which has ended or was never given"
        if number <= self._number:
            return f"sequence: expected a number greater than {self._number}, came {number}: it was sent before"
        return None

    def use(self, number: int) -> None:
        """Use up the number of what was let in without a look at its age."""
        self._number = number

    def _why_late(self, stamp_ns: int, age_ns: int | None) -> str | None:
        late_ns = self._later_than_others(stamp_ns) if age_ns is None else age_ns
        limit_ms = self._max_age_ns / 1e6
        if late_ns > self._max_age_ns:
            return f"age: expected a command not older than {limit_ms:g} ms, came one {late_ns / 1e6:.0f} ms old"
        if late_ns < -AHEAD_NS:
            return f"age: expected a stamp of the past, came one {-late_ns / 1e6:.0f} ms ahead"
        return None

    def _later_than_others(self, stamp_ns: int) -> int:
        """Return how much longer this one took than the fastest; what is faster than it is the fastest from now on."""
        now_ns = self._now_ns()
        took_ns = now_ns - stamp_ns
        if self._fastest_ns is not None:
            self._fastest_ns += round(DRIFT * (now_ns - self._fastest_at_ns))
        self._fastest_at_ns = now_ns
        if self._fastest_ns is None or took_ns < self._fastest_ns:
            self._fastest_ns = took_ns
        return took_ns - self._fastest_ns
