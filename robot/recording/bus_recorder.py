"""The recorder of a running rig: all that its processes write, and a learner's account so that it can be replayed.

What comes is put into a queue on the bus's own thread and written on this one. Four times a second what waits goes to
the disk, and the learner is told how far its account is written: a recorder that is killed loses that much of the rest,
and of the account nothing, for it is told again.
"""

from collections.abc import Callable, Iterable
from functools import partial
from queue import Empty, Full, Queue
from time import monotonic
from typing import Any

import msgspec

from robot.bus import Bus, Received, Topic
from robot.bus.account_rows import AccountPart, AccountWritten
from robot.bus.errors import BusError
from robot.bus.tick_rows import TickBatch
from robot.bus.topics import ACCOUNT, ARM_STATE, PERCEPT, TICKS, WRITTEN
from robot.messages import ArmState
from robot.node.pulse import Pulse
from robot.recording.account_order import AccountOrder
from robot.recording.errors import DamagedError
from robot.recording.messages import Event
from robot.recording.opening import OPENING, Opening
from robot.recording.recording import Recording
from robot.recording.session_files import SessionFiles
from robot.recording.told_ticks import ToldTicks
from robot.recording.topics import EVENT, RECORDED, as_on_the_bus

__all__ = ["BusRecorder"]

FLUSH_S, LOOK_S = 0.25, 0.05
MOST_WAITING = 50_000
Came = tuple[Topic[Any], Received[Any]]
_TOLD = {topic.name: topic for topic in RECORDED}


class BusRecorder:
    """Records until it is told to end.

    Args:
        bus: open; this process is a recorder there.
        files: begins files.
        topics: what is listened to, besides accounts.

    Attributes:
        pulse: how its loop goes.
        n: Messages recorded.
        n_left_out: Messages that came faster than they could be written.
    """

    def __init__(self, bus: Bus, files: SessionFiles, topics: Iterable[Topic[Any]]) -> None:
        self.pulse, self.n, self.n_left_out = Pulse(), 0, 0
        self._files, self._order = files, AccountOrder()
        self._is_told, self._is_open = False, False
        self._recording: Recording = files.watch()
        first = self._recording
        self._ticks = ToldTicks(first.wire_ticks, is_sure=first.is_on_a_wire, is_aside=first.are_ticks_aside)
        self._shown = self._recording.shown()
        self._measured: ArmState | None = None
        self._came: Queue[Came] = Queue(MOST_WAITING)
        self._newest_ns = self._offset_ns = self._n_missed = 0
        self._written = AccountWritten(account=0, number=-1, is_open=False)
        self._says = bus.publisher(WRITTEN)
        self._open = [bus.subscriber(topic, partial(self._take, topic)) for topic in (*topics, ACCOUNT)]

    def run(self, is_over: Callable[[], bool], *, now_s: Callable[[], float] = monotonic) -> None:
        """Record until told that it is over, and then what has come by then."""
        due_s = now_s() + FLUSH_S
        while not is_over():
            self.pulse.beat()
            self._write_one(LOOK_S)
            if now_s() >= due_s:
                due_s = now_s() + FLUSH_S
                self.flush()
        for subscriber in self._open:
            subscriber.close()
        while not self._came.empty():
            self._write_one(0.0)
        self.close()

    def flush(self) -> None:
        """Hand what waits to the disk, and say how far the account was written by then."""
        order, is_open = self._order, self._is_open
        here = AccountWritten(account=order.account, number=order.number, is_open=is_open)
        self._recording.recorder.flush(lambda: self._note_written(here))
        self.pulse.queue = self._came.qsize()
        self.pulse.doing = f"{self._recording.path.name}, {self.n} messages"
        if self._written.account:
            self._says.put(self._written)

    def close(self) -> None:
        """Finish the file. Idempotent."""
        order = self._order
        self._recording.close()
        self._files.close()
        if order.account and self._recording.recorder.n_lost == 0:
            self._says.put(AccountWritten(account=order.account, number=order.number, is_open=self._is_open))

    def lost(self) -> int:
        """Return how many messages were written and never came."""
        return sum(subscriber.counts.lost for subscriber in self._open)

    def _note_written(self, written: AccountWritten) -> None:
        """Note how far the account is in the file. Called on the writing thread."""
        self._written = written

    def _take(self, topic: Topic[Any], received: Received[Any]) -> None:
        try:
            self._came.put_nowait((topic, received))
        except Full:
            self.n_left_out += 1

    def _write_one(self, timeout_s: float) -> None:
        try:
            topic, received = self._came.get(timeout=timeout_s) if timeout_s else self._came.get_nowait()
        except Empty:
            return
        self._newest_ns = max(self._newest_ns, received.arrived_ns)
        if topic is ACCOUNT:
            self._hear(received)
            return
        if topic is TICKS:
            self._take_ticks(received)
            return
        named = self._ticks.named(as_on_the_bus(topic, is_told=self._is_told), received.message)
        self._recording.recorder.write(
            named, received.message, log_ns=self._newest_ns, stamp_ns=max(0, received.stamp_ns)
        )
        self.n += 1
        if topic is ARM_STATE:
            self._measured = received.message
        elif topic is PERCEPT:
            state = self._ticks.state or self._measured
            self._shown.perceived(received.message, state, log_ns=self._newest_ns)

    def _take_ticks(self, received: Received[TickBatch]) -> None:
        try:
            self.n += self._ticks.take_batch(received)
        except BusError as error:
            self.pulse.fail(str(error))

    # ------------------------------------------------------------------------------------------------------- account

    def _hear(self, received: Received[AccountPart]) -> None:
        first: AccountPart = received.message
        if first.account != self._order.account:
            self._is_told = self._is_open = False
            self._offset_ns = 0 if received.age_ns is not None else received.arrived_ns - first.log_ns
        for part in self._order.take(first):
            self._write_part(part, self._offset_ns + part.log_ns)
        missed, self._n_missed = self._order.n_missed - self._n_missed, self._order.n_missed
        if missed:
            event = Event(
                what="account with a gap", detail=f"{missed} parts never came: it cannot be replayed past here"
            )
            self._recording.recorder.write(EVENT, event, log_ns=self._newest_ns)

    def _write_part(self, part: AccountPart, log_ns: int) -> None:
        if part.topic == OPENING.name:
            self._begin(lambda: self._opened(part, log_ns))
            return
        topic = _TOLD.get(part.topic)
        if topic is None:
            self.pulse.fail(f"account: expected a topic of a session, came {part.topic[:40]!r}")
            return
        if not self._is_told:
            self._begin(lambda: self._files.go_on(part.account))
        stamp_ns = max(0, part.stamp_ns + self._offset_ns)
        self._recording.recorder.put(
            topic, part.payload, log_ns=max(0, log_ns), stamp_ns=stamp_ns, has_words=part.has_words
        )
        self.n += 1

    def _opened(self, part: AccountPart, log_ns: int) -> Recording:
        try:
            opening = msgspec.json.decode(part.payload, type=Opening)
        except msgspec.MsgspecError as error:
            raise DamagedError(f"account: expected an opening, came none: {error}") from error
        recording = self._files.open(opening, log_ns=max(0, log_ns))
        self._is_open = True
        return recording

    def _begin(self, make: Callable[[], Recording]) -> None:
        """Begin a new file; what is in the old one is whole by then."""
        try:
            begun = make()
        except (DamagedError, ValueError, OSError) as error:
            self.pulse.fail(str(error))
            self._is_told = True
            return
        self._recording.close()
        self._recording, self._is_told = begun, True
        self._ticks.go_on(begun.wire_ticks)
        self._shown = begun.shown()
