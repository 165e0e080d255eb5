"""A learner's account of itself over the bus: what `Recording` is to a file. The edge is the bus that it is told on."""

from base64 import b64encode
from collections.abc import Callable
from hashlib import sha256
from time import monotonic_ns

import msgspec

from config.resolved import Resolved, dump_resolved
from robot.recording.account import Account
from robot.recording.messages import Purpose
from robot.recording.opening import OPENING, Opening
from robot.recording.taps import RecordedStation
from robot.station import Station

__all__ = ["BusAccount"]

END_S = 5.0


class _Digest:
    """A digest that can begin anew, at an opening."""

    def __init__(self) -> None:
        self._of = sha256()

    def update(self, data: bytes, /) -> None:
        self._of.update(data)

    def hexdigest(self) -> str:
        return self._of.hexdigest()

    def begin(self) -> None:
        self._of = sha256()


class BusAccount:
    """Tells a recorder on the bus, where there is one, all that a replay needs. Nothing waits for it.

    Args:
        account: numbers and keeps what is told.
        resolved: what the run is made of.
        seed: its root seed.
        when_closed: called at the end.

    Attributes:
        recorder: Takes messages of a session's topics.
        heard: Digest of percepts and outcomes since the last opening.
    """

    def __init__(
        self, account: Account, resolved: Resolved, *, seed: int, when_closed: Callable[[], object] = lambda: None,
        now_ns: Callable[[], int] = monotonic_ns,
    ) -> None:  # fmt: skip
        self.recorder, self.heard = account, _Digest()
        self._resolved, self._seed, self._when_closed, self._now_ns = resolved, seed, when_closed, now_ns
        self._station: RecordedStation | None = None
        self._is_closed = False

    def station(self, station: Station, *, purpose: Purpose | None = None) -> RecordedStation:
        """Return a station of which is told; what its arm measures and is sent, a recorder hears on the bus itself."""
        is_own = purpose in (None, Purpose.LEARN)
        told = RecordedStation(
            station, self.recorder, purpose=purpose or Purpose.LEARN, now_ns=self._now_ns,
            heard=self.heard if is_own else None,
        )  # fmt: skip
        self._station = self._station or told
        return told

    def at_ns(self) -> int:
        """Return the session's time."""
        return self._now_ns()

    def open(self, n_done: int, state: bytes) -> None:
        """Tell what the learner is now, between two epochs: a file that begins here can be replayed alone.

        Args:
            n_done: epochs done.
            state: of the learner, as a checkpoint keeps it.
        """
        assert self._station is not None, "there is a station first"
        self.heard.begin()
        resolved = self._resolved
        opening = Opening(
            seed=self._seed, n_done=n_done, learner=resolved.learning.name, config=dump_resolved(resolved),
            spec=self._station.spec, state=b64encode(state).decode(),
        )  # fmt: skip
        at_ns = self._now_ns()
        self.recorder.begin()
        self.recorder.tell(OPENING.name, msgspec.json.encode(opening), log_ns=at_ns, stamp_ns=at_ns)

    def kept(self, n_done: int, make_state: Callable[[], bytes]) -> None:
        """Open anew at an epoch's boundary, where a recorder was started in the account's midst."""
        if self.recorder.wants_opening:
            self.open(n_done, make_state())

    def close(self) -> None:
        """Let the recorder come to the end, if there is one. Idempotent."""
        if not self._is_closed:
            self._is_closed = True
            self.recorder.finish(within_s=END_S)
            self._when_closed()
