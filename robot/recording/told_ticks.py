"""Ticks of an arm on a wire, as they are recorded: like those of one in this process. State.

What a robot node tells of single ticks besides, for whoever watches, is the same once more and thinned, and how an arm
stands that nobody moves: once ticks have come it goes under names of its own.
"""

from typing import Any

import msgspec

from robot.bus.inlet import Received
from robot.bus.tick_rows import TickBatch, unpack_ticks
from robot.bus.topic import Topic
from robot.bus.topics import ARM_STATE, REQUESTED, SENT, VERDICT
from robot.messages import ArmState
from robot.recording.taps import RecordedTicks, WritesBytes
from robot.tick_ring import Tick, TickReader, decode_tick

__all__ = ["THINNED", "TakenTicks", "ToldTicks"]

THINNED: tuple[str, ...] = (ARM_STATE.name, REQUESTED.name, SENT.name, VERDICT.name)


class ToldTicks:
    """Records ticks.

    Args:
        writes: takes measurement, command and verdict of each.
        is_sure: ticks will come, as of every arm on a wire: nothing is taken in their place.
        is_aside: they are recorded elsewhere: what is thinned is what the session has.

    Attributes:
        n: Ticks so far.
    """

    def __init__(self, writes: WritesBytes, *, is_sure: bool = False, is_aside: bool = False) -> None:
        self._now_ns, self._is_sure, self._is_aside = 0, is_sure, is_aside
        self._ticks = RecordedTicks(writes, now_ns=lambda: self._now_ns)
        self._before_ns = dict.fromkeys(THINNED, -1)
        """Stamp of the newest that was recorded in a tick's place, by its topic."""
        self.n = 0

    @property
    def state(self) -> ArmState | None:
        """The newest measurement."""
        return self._ticks.state

    def go_on(self, writes: WritesBytes) -> None:
        """Record into another file from now on."""
        self._ticks = RecordedTicks(writes, now_ns=lambda: self._now_ns)

    def take_batch(self, received: Received[TickBatch]) -> int:
        """Record ticks as they come over the bus, and return how many; by their own times where clocks are one.

        Raises:
            BusError: they are none, or another version's.
        """
        ticks = unpack_ticks(received.message)
        for tick in ticks:
            offset_ns = 0 if received.age_ns is not None else received.arrived_ns - ticks[-1].at_ns
            self.take(tick, offset_ns=offset_ns)
        return len(ticks)

    def take(self, tick: Tick, *, offset_ns: int = 0) -> None:
        """Record a tick.

        Args:
            tick: later than all before.
            offset_ns: the session's clock less that of the machine that ticks.
        """
        self.n += 1
        if tick.state is not None and tick.state.stamp_ns > self._before_ns[ARM_STATE.name]:
            self._now_ns = max(0, tick.measured_ns + offset_ns)
            self._ticks.measured(tick.state)
        self._now_ns = max(0, tick.at_ns + offset_ns)
        if tick.command is not None and tick.command.stamp_ns > self._before_ns[REQUESTED.name]:
            self._ticks.commanded(tick.command, tick.limiters, tick.verdict)
        elif tick.verdict is not None and tick.verdict.stamp_ns > self._before_ns[VERDICT.name]:
            self._ticks.refused(tick.verdict)

    def named(self, topic: Topic[Any], message: object) -> Topic[Any]:
        """Return what a message of a robot node's is recorded as: `bus/NAME` once every tick comes besides.

        Args:
            topic: as sessions have it.
            message: the same.
        """
        if topic.name not in self._before_ns or self._is_aside:
            return topic
        if self.n or self._is_sure:
            return msgspec.structs.replace(topic, name=f"bus/{topic.name}")
        self._before_ns[topic.name] = max(self._before_ns[topic.name], getattr(message, "stamp_ns", -1))
        return topic


class TakenTicks:
    """Records the ticks of a servo process of this process's own, whenever it is called.

    Args:
        reader: of its ticks.
        writes: takes them; the session's clock is this machine's.
        is_aside: they are recorded elsewhere, and the session needs its own.
    """

    def __init__(self, reader: TickReader, writes: WritesBytes, *, is_aside: bool = False) -> None:
        self._reader, self._told, self._is_aside = reader, ToldTicks(writes), is_aside
        reader.take()  # what was before the recording

    def __call__(self) -> bool:
        """Record what has come, and return whether that is all that the session needs of the arm."""
        for raw in self._reader.take():
            self._told.take(decode_tick(raw))
        return not self._is_aside
