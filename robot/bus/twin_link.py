"""What a station knows of a twin in another process: its truth, and how to have the table laid out."""

from typing import Protocol

import msgspec

from robot.bus.latest import Latest
from robot.bus.session import Bus
from robot.bus.topics import RESET, TRUTH, ResetRequest
from robot.messages import SceneState

__all__ = ["RemoteResetter", "RemoteTruth"]


class RemoteTruth:
    """The newest truth that arrived (robot.hal.protocols.SceneTruth).

    Args:
        bus: Open.
    """

    def __init__(self, bus: Bus) -> None:
        self._latest = Latest(bus, TRUTH, writes="the twin")

    def wait_next(self, n: int = 2) -> None:
        """Wait for so many messages from now on, so that the newest tells of what holds now.

        Raises:
            StaleStateError: they do not come within 5 s.
            BusError: what came was no truth.
        """
        self._latest.wait_next(n)

    def read(self) -> SceneState:
        """Return the newest truth, stamped with this host's monotonic time.

        Raises:
            StaleStateError: the newest is too old, or there is none.
            BusError: what came was no truth.
        """
        newest = self._latest.read()
        return msgspec.structs.replace(newest.message, stamp_ns=newest.stamp_ns)


class _Stops(Protocol):
    """What a reset needs of the loop."""

    def stop(self) -> None:
        """Stop the arm and give up command."""
        ...

    def await_rest(self) -> None:
        """Wait until an arm that was lost must be at rest."""
        ...


class RemoteResetter:
    """Has the table laid out by the twin's process (robot.hal.protocols.Resetter).

    The arm is stopped and let go of first: whoever resets puts it somewhere else.

    Args:
        bus: Open.
        loop: What holds the arm.
        truth: Waited for after a reset, so that nobody sees the table as it was before.
    """

    def __init__(self, bus: Bus, *, loop: _Stops, truth: RemoteTruth) -> None:
        self._asker, self._loop, self._truth = bus.asker(RESET), loop, truth

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Lay the table out for an epoch.

        Raises:
            BusError: nobody answers, or the answer is an error.
        """
        self._loop.stop()
        self._loop.await_rest()
        self._asker.ask(ResetRequest(seed=seed, epoch=epoch, digital_out=digital_out))
        self._truth.wait_next()
