"""What goes on around the word that has a servo process take command: who listens meanwhile, and what a loss leaves."""

from collections.abc import Callable, Iterator, MutableSequence
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait

from robot.errors import RobotError, StaleStateError
from robot.hal.leftover import Leftover
from robot.hal.taking_watch import TakingWatch

__all__ = ["Taking", "has_come"]

NOTHING_SENT = "it was lost before anything was sent to the arm: what runs there is somebody else's"
WHILE_TAKING = (
    "it was lost while it took command, when no watchdog may have been armed yet: a program that it left, known by its "
    "name, is ended as soon as the controller can be reached, for 2 s; after that look at the pendant"
)


class Taking:
    """Stands by while a process takes command of the arm at an address.

    Args:
        address: host of the controller; None for an arm without one, which takes no watching.

    Attributes:
        uploaded: Shared memory of one number, 1 once the process has begun to upload a program.
    """

    def __init__(self, address: str | None) -> None:
        self._address = address
        self.uploaded: MutableSequence[int] = get_context("spawn").RawArray("q", 1)
        self._leftover = None if address is None else Leftover(address)

    @contextmanager
    def watched(self, *, end: Callable[[], object], is_gone: Callable[[], bool]) -> Iterator[int | None]:
        """Listen to the controller while a process takes command; what one that was lost left on the arm is ended.

        What runs on the arm when a process is lost that has not begun to upload is somebody else's, and is left alone.

        Gives a descriptor that can be read once `end` was called; None where nobody listens.

        Args:
            end: ends the process, from another thread: it cannot know that its controller was lost.
            is_gone: whether it has ended.

        Raises:
            RobotError: what was raised inside, with what was seen of a loss; or nobody answers at the address.
        """
        self.uploaded[0] = 0
        if self._address is None or self._leftover is None:
            yield None
            return
        self._leftover.listen()
        watch = TakingWatch(self._address, when_lost=end)
        is_lost = False
        try:
            with watch:
                yield watch.alarm
        except RobotError as error:
            if not is_gone():
                raise
            if not self.uploaded[0]:
                raise type(error)(f"{watch.why or error}; {NOTHING_SENT}") from error
            foreign = self._leftover.foreign()
            is_lost = True
            self._leftover.begin()
            what = watch.why or str(error)
            if foreign is not None and repr(foreign) not in what:
                what = f"{what}; somebody started the program {foreign!r} on the controller meanwhile"
            raise type(error)(f"{what}; {WHILE_TAKING}") from error
        finally:
            if not is_lost:
                self._leftover.wait()

    def wait(self) -> None:
        """Wait until what a loss left is ended, or cannot be."""
        if self._leftover is not None:
            self._leftover.wait()


def has_come(connection: Connection, timeout_s: float, alarm: int | None = None) -> bool:
    """Wait for what a process says. Returns whether anything came in time.

    Args:
        connection: the pipe that leads to it.
        timeout_s: how long to wait.
        alarm: a descriptor that can be read once the process is being ended.

    Raises:
        StaleStateError: it is.
    """
    if alarm is None:
        return connection.poll(timeout_s)
    came = wait([connection, alarm], timeout_s)
    if came == [alarm]:
        raise StaleStateError("servo process: it was killed")
    return bool(came)
