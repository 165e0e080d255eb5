"""Every tick of an arm in memory that outlives the process which ticks: the last half minute of them. State.

One process writes, another reads, and nobody waits: a slot says which tick lies in it and has a checksum, so that one
that was overwritten, or whose writer was killed in the middle of it, is none. A reader that is late misses the oldest
and knows how many.
"""

from collections.abc import Callable, MutableSequence
from struct import Struct as Form
from time import monotonic_ns
from zlib import crc32

import msgspec

from robot.messages import ArmCommand, ArmState, Verdict

__all__ = ["KEPT_S", "Tick", "TickReader", "TickWriter", "decode_tick", "ring_bytes", "ticks_of"]

KEPT_S = 30.0
SLOT_BYTES = 1024
_HEAD = Form("QII")
FIRST_AT = 64
MOST_BYTES = SLOT_BYTES - _HEAD.size
MOST_WORDS = 60
"""Of a refusal's detail, where the whole of it has no room."""


class Tick(msgspec.Struct, frozen=True, array_like=True):
    """What one tick measured, asked for and was told."""

    measured_ns: int
    """When the measurement was read, by the monotonic clock of the machine that ticks."""
    at_ns: int
    """When the command was judged, by the same."""
    state: ArmState | None
    """None where it is that of the tick before."""
    command: ArmCommand | None = None
    """None where nothing was asked for: an intent was refused, or a wire failed."""
    limiters: tuple[str, ...] = ()
    verdict: Verdict | None = None
    """A refusal; None where the command was sent."""


decode_tick = msgspec.msgpack.Decoder(Tick).decode
"""Returns a tick from what a reader took."""


def ring_bytes(rate_hz: float, *, seconds: float = KEPT_S) -> int:
    """Return how much memory holds so many seconds of ticks."""
    return FIRST_AT + max(1, round(rate_hz * seconds)) * SLOT_BYTES


class TickWriter:
    """Writes ticks over the oldest ones; implements robot.tick_tap.TickTap.

    Args:
        memory: bytes that are shared with a reader; a number of ticks that lie there already goes on.
        now_ns: this machine's monotonic clock.
    """

    def __init__(self, memory: MutableSequence[int], *, now_ns: Callable[[], int] = monotonic_ns) -> None:
        self._memory, self._count = _views(memory)
        self._now_ns, self._n_slots = now_ns, (len(self._memory) - FIRST_AT) // SLOT_BYTES
        self._n = self._count[0]
        self._encode = msgspec.msgpack.Encoder().encode
        self._state: ArmState | None = None
        self._told_ns = self._measured_ns = -1

    def measured(self, state: ArmState) -> None:
        """Take note of a measurement; it is written with what is asked for next."""
        self._state, self._measured_ns = state, self._now_ns()

    def commanded(self, command: ArmCommand, limiters: tuple[str, ...], verdict: Verdict | None) -> None:
        """Write a tick."""
        self._put(Tick(self._measured_ns, self._now_ns(), self._newest(), command, limiters, verdict))

    def refused(self, verdict: Verdict) -> None:
        """Write a refusal that was of no command."""
        self._put(Tick(self._measured_ns, self._now_ns(), self._newest(), verdict=verdict))

    def _newest(self) -> ArmState | None:
        state = self._state
        if state is None or state.stamp_ns == self._told_ns:
            return None
        self._told_ns = state.stamp_ns
        return state

    def _put(self, tick: Tick) -> None:
        raw = self._encode(tick)
        if len(raw) > MOST_BYTES:
            raw = self._encode(_cut_short(tick))
        self._n += 1
        at = FIRST_AT + self._n % self._n_slots * SLOT_BYTES
        begin = at + _HEAD.size
        self._memory[begin : begin + len(raw)] = raw
        _HEAD.pack_into(self._memory, at, self._n, len(raw), crc32(raw))
        self._count[0] = self._n  # at once: struct would write zeros first, and a reader would begin anew


class TickReader:
    """Reads what a writer has written since the last time.

    Args:
        memory: the same bytes.

    Attributes:
        n_missed: Ticks that were overwritten before they were read.
    """

    def __init__(self, memory: MutableSequence[int]) -> None:
        self._memory, self._count = _views(memory)
        self._n_slots = (len(self._memory) - FIRST_AT) // SLOT_BYTES
        self._n = self._count[0]
        self.n_missed = 0

    @property
    def n_waiting(self) -> int:
        """Ticks that were written and not read yet."""
        return max(0, self._count[0] - self._n)

    def take(self, most: int | None = None) -> list[bytes]:
        """Return ticks as they were written, the oldest first.

        Args:
            most: how many, at most.
        """
        newest = max(self._n, self._count[0])
        oldest = max(self._n, newest - self._n_slots)
        self.n_missed += oldest - self._n
        end = newest if most is None else min(newest, oldest + most)
        found: list[bytes] = []
        for number in range(oldest + 1, end + 1):
            raw = self._read(number)
            if raw is None:
                self.n_missed += 1
            else:
                found.append(raw)
        self._n = end
        return found

    def _read(self, number: int) -> bytes | None:
        """Return a tick; None where it is overwritten, or was never finished."""
        at = FIRST_AT + number % self._n_slots * SLOT_BYTES
        written, length, crc = _HEAD.unpack_from(self._memory, at)
        if written != number or length > MOST_BYTES:
            return None
        raw = bytes(self._memory[at + _HEAD.size : at + _HEAD.size + length])
        return raw if crc32(raw) == crc else None


def _views(memory: MutableSequence[int]) -> tuple[memoryview, memoryview]:
    """Return a memory's bytes, and the number of ticks so far at its beginning."""
    whole = memoryview(memory).cast("B")  # pyright: ignore[reportArgumentType] - an array
    return whole, whole[:8].cast("Q")


def ticks_of(station: object) -> TickReader | None:
    """Return what reads the ticks of a station's arm; None where no process of this one's own holds it."""
    found = getattr(getattr(station, "loop", None), "ticks", None)
    return found if isinstance(found, TickReader) else None


def _cut_short(tick: Tick) -> Tick:
    """Return a tick whose refusal has room: without what was refused, which the time step tells, and of few words."""
    verdict = tick.verdict
    if verdict is not None:
        verdict = msgspec.structs.replace(verdict, refused=None, detail=verdict.detail[:MOST_WORDS])
    return Tick(tick.measured_ns, tick.at_ns, tick.state, tick.command, tick.limiters[:4], verdict)
