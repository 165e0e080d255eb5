"""What a station knows of a twin in another process: its truth, and how to have the table laid out."""

from threading import Condition
from time import monotonic_ns
from typing import Protocol

import msgspec
import zenoh

from robot.bus.session import BusError
from robot.bus.topics import RESET, TRUTH, ResetRequest, topic
from robot.errors import StaleStateError
from robot.messages import SceneState

__all__ = ["RemoteResetter", "RemoteTruth"]

TRUTH_AGE_NS = 100_000_000
FIRST_S, RESET_S = 5.0, 20.0


class RemoteTruth:
    """The newest truth that arrived, stamped on arrival (robot.hal.protocols.SceneTruth)."""

    def __init__(self, session: zenoh.Session, serial: str) -> None:
        self._newest: tuple[int, bytes] | None = None
        self._arrival = Condition()
        self._n_arrived = 0
        self._decode = msgspec.json.Decoder(SceneState).decode
        self._subscriber = session.declare_subscriber(topic(serial, TRUTH), self._take_in)

    def _take_in(self, sample: zenoh.Sample) -> None:
        with self._arrival:
            self._newest = (monotonic_ns(), sample.payload.to_bytes())
            self._n_arrived += 1
            self._arrival.notify_all()

    def wait_next(self, n: int = 2) -> None:
        """Wait for so many messages from now on, so that the newest tells of what holds now.

        Raises:
            StaleStateError: they do not come within 5 s.
        """
        with self._arrival:
            wanted = self._n_arrived + n
            if not self._arrival.wait_for(lambda: self._n_arrived >= wanted, FIRST_S):
                raise StaleStateError(f"twin/truth: expected a message within {FIRST_S:g} s; does the twin run?")

    def read(self) -> SceneState:
        """Return the newest truth, stamped with this host's monotonic time.

        Raises:
            StaleStateError: none came within the last 100 ms, or what came last is none: nothing is known then.
        """
        newest = self._newest
        if newest is None:
            raise StaleStateError("twin/truth: expected a message each 10 ms, none came yet; does the twin run?")
        stamp_ns, raw = newest
        age_ns = monotonic_ns() - stamp_ns
        if age_ns > TRUTH_AGE_NS:
            raise StaleStateError(f"twin/truth: expected a message each 10 ms, the newest is {age_ns / 1e6:.0f} ms old")
        try:
            scene = self._decode(raw)
        except (ValueError, RecursionError) as error:
            raise StaleStateError(
                f"twin/truth: expected a SceneState, came {len(raw)} bytes of none: {error}"
            ) from error
        return msgspec.structs.replace(scene, stamp_ns=stamp_ns)


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
    """

    def __init__(self, session: zenoh.Session, serial: str, *, loop: _Stops, truth: RemoteTruth) -> None:
        """Store.

        Args:
            session: the bus.
            serial: the plant's.
            loop: what holds the arm.
            truth: waited for after a reset, so that nobody sees the table as it was before.
        """
        self._session, self._key, self._loop, self._truth = session, topic(serial, RESET), loop, truth

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Lay the table out for an epoch.

        Raises:
            BusError: nobody answers, or the answer is an error.
        """
        self._loop.stop()
        self._loop.await_rest()
        payload = msgspec.json.encode(ResetRequest(seed=seed, epoch=epoch, digital_out=digital_out))
        replies = list(self._session.get(self._key, payload=payload, timeout=RESET_S))
        if not replies:
            raise BusError(f"{self._key}: expected an answer within {RESET_S:g} s, none came; does the twin run?")
        if replies[0].err is not None:
            raise BusError(f"{self._key}: {replies[0].err.payload.to_string()}")
        self._truth.wait_next()
