"""What comes to a robot node between two looks of its loop. Filled on the bus's thread, emptied by the loop."""

from collections import deque
from collections.abc import Callable
from threading import Condition

from robot.bus.inlet import Received
from robot.bus.session import Bus
from robot.bus.station_rows import Beat, Command, StopAsk
from robot.bus.topics import BEAT, INTENT, STOP
from robot.node.admission import Admission

__all__ = ["Inbox", "Refused"]

N_REFUSED, N_STOPS = 8, 64


class Refused:
    """A command that was not let in, and why: whoever sent it may wait for an answer."""

    def __init__(self, command: Command, why: str) -> None:
        self.command, self.why = command, why


class Inbox:
    """Judges commands as they come, so that a flood of wrong ones takes no room from the right one.

    Args:
        bus: open.
        admission: what is let in.
        halt: told of a stop at once, on the bus's own thread.
    """

    def __init__(self, bus: Bus, admission: Admission, *, halt: Callable[[], object]) -> None:
        self._admission, self._halt = admission, halt
        self._came = Condition()
        self._command: Command | None = None
        self._refused: deque[Refused] = deque(maxlen=N_REFUSED)
        self._stops: deque[StopAsk] = deque(maxlen=N_STOPS)
        self._has_beat = self._is_repeated = False
        self._open = (
            bus.subscriber(STOP, self._take_stop), bus.subscriber(INTENT, self._take), bus.subscriber(BEAT, self._hear)
        )  # fmt: skip

    @property
    def n_waiting(self) -> int:
        """Things that nobody has looked at."""
        return len(self._stops) + len(self._refused) + (self._command is not None) + self._is_repeated

    def wait(self, seconds: float) -> None:
        """Wait until something is there, at most so long."""
        with self._came:
            self._came.wait_for(lambda: self.n_waiting > 0, seconds)

    @property
    def has_stop(self) -> bool:
        """Whether somebody said stop and nobody has carried it out."""
        return bool(self._stops)

    def stop(self) -> StopAsk | None:
        """Take the oldest stop out."""
        with self._came:
            return self._stops.popleft() if self._stops else None

    def command(self) -> Command | None:
        """Take the newest command out; what it overtook is gone."""
        with self._came:
            command, self._command = self._command, None
        return command

    def refused(self) -> Refused | None:
        """Take one of the newest that were not let in out."""
        return self._refused.popleft() if self._refused else None

    def has_beat(self) -> bool:
        """Whether who has the lease was heard since the last look."""
        has_beat, self._has_beat = self._has_beat, False
        return has_beat

    def is_repeated(self) -> bool:
        """Whether the command that was let in last came once more since the last look."""
        is_repeated, self._is_repeated = self._is_repeated, False
        return is_repeated

    def begin(self, lease: str) -> None:
        """Let in what comes under a new lease alone; what came under another is gone."""
        with self._came:
            self._admission.begin(lease)
            self._command, self._has_beat = None, False

    def close(self) -> None:
        """Hear no more. Idempotent."""
        for subscriber in self._open:
            subscriber.close()

    def _take(self, received: Received[Command]) -> None:
        command = received.message
        with self._came:
            if self._admission.is_repeat(command.lease, command.number):
                self._is_repeated = True
                self._came.notify_all()
                return
            why = self._admission.why_not(
                command.lease, command.number, stamp_ns=received.envelope.stamp_ns, age_ns=received.age_ns
            )
            if why is None:
                self._command, self._has_beat, self._is_repeated = command, True, False
            else:
                self._refused.append(Refused(command, why))
            self._came.notify_all()

    def _take_stop(self, received: Received[StopAsk]) -> None:
        with self._came:  # one with the other: whoever has carried a stop out ends its halt, and looks for the next one
            self._stops.append(received.message)
            self._halt()
            self._came.notify_all()

    def _hear(self, received: Received[Beat]) -> None:
        deadline_s, age_ns = BEAT.deadline_s, received.age_ns
        is_late = deadline_s is not None and age_ns is not None and age_ns > deadline_s * 1e9
        if received.message.lease == self._admission.lease and not is_late:
            self._has_beat = True
