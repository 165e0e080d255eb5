"""A session once more over a bus of its own, as if it were live: for whoever develops what perceives, or shows.

The bus is this process's: where a rig's own is open the replay is refused, so that nothing that was recorded is ever
taken for what is. What commands an arm is not in the table of what is replayed.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from time import monotonic_ns, sleep
from typing import Any

import msgspec

from robot.bus import Bus, Publisher, Role, Topic
from robot.bus.topics import (
    ARM_STATE,
    CAMERA_IMAGE,
    HEALTH,
    LIGHT,
    PERCEPT,
    REPORT,
    REQUESTED,
    SENT,
    TRUTH,
    VERDICT,
)
from robot.recording.errors import UnfitError
from robot.recording.session_file import SessionFile

__all__ = ["REPLAYED", "BusReplay", "ReplayedToBus", "Said", "replay_to_bus", "said_in"]

REPLAYED: tuple[Topic[Any], ...] = (
    ARM_STATE, REQUESTED, SENT, VERDICT, TRUTH, PERCEPT, CAMERA_IMAGE, LIGHT, HEALTH, REPORT
)  # fmt: skip
"""What was measured, perceived and judged. No intent, stop, lease or question is among it."""
ENDPOINT = "tcp/127.0.0.1:7457"
LOOK_S = 0.02
THIN = 0.5
"""What came more often than this many times a topic's rate allows is thinned to it, as a robot node does."""


class Said(msgspec.Struct, frozen=True, kw_only=True):
    """One message of a session, with when it was."""

    topic: Topic[Any]
    message: Any
    log_ns: int


class ReplayedToBus(msgspec.Struct, frozen=True, kw_only=True):
    """What a replay came to."""

    n_by_topic: dict[str, int]
    seconds: float
    """Of the session."""
    late_ms: float
    """How late a message was at most."""
    is_same: bool = True

    def told(self) -> dict[str, object]:
        """Return all of it, for a script."""
        return msgspec.structs.asdict(self)

    def lines(self) -> Iterator[str]:
        """Yield it in words."""
        for name, n in sorted(self.n_by_topic.items()):
            yield f"{name}: {n} messages"
        yield f"{self.seconds:.1f} s of the session, {self.late_ms:.1f} ms late at most"


def said_in(session: SessionFile, *, from_s: float = 0.0, to_s: float = float("inf")) -> Iterator[Said]:
    """Yield what is replayed of a span of a session: of a topic that was told on a bus, that; ticks thinned.

    Args:
        session: open.
        from_s: seconds since its beginning.
        to_s: the same.
    """
    begin_ns = 0 if session.statistics is None else session.statistics.start_ns
    names = {channel.topic for channel in session.channels.values()}
    told = [msgspec.structs.replace(t, name=f"bus/{t.name}") for t in REPLAYED if f"bus/{t.name}" in names]
    plain = [t for t in REPLAYED if t.name in names and f"bus/{t.name}" not in names]
    rows = {topic.name: topic for topic in REPLAYED}
    due_ns: dict[str, float] = {}
    for topic, raw, message in session.messages(*told, *plain):
        at_s, row = (raw.log_ns - begin_ns) / 1e9, rows[topic.name.removeprefix("bus/")]
        if at_s > to_s:
            return
        if at_s < from_s or raw.log_ns < due_ns.get(row.name, 0.0):
            continue
        if row.rate_hz is not None and row is not VERDICT:
            due_ns[row.name] = raw.log_ns + THIN / row.rate_hz * 1e9
        yield Said(topic=row, message=message, log_ns=raw.log_ns)


class BusReplay:
    """Says a session's messages at their times.

    Args:
        session: open.
        put: says one, as of a time of this machine's clock.
        rate: how many times as fast as it was.
        now_ns: this machine's monotonic clock.
        wait: lets time pass.
    """

    def __init__(
        self, session: SessionFile, put: Callable[[Topic[Any], Any, int], object], *, rate: float = 1.0,
        now_ns: Callable[[], int] = monotonic_ns, wait: Callable[[float], object] = sleep,
    ) -> None:  # fmt: skip
        self._session, self._put, self._rate = session, put, rate
        self._now_ns, self._wait = now_ns, wait
        self._sought_s: float | None = None
        self._n: dict[str, int] = {}
        self._late_ns = 0
        self._seconds = 0.0

    def seek(self, at_s: float) -> None:
        """Go on from there, seconds since the session's beginning. From any thread."""
        self._sought_s = at_s

    def run(
        self, *, from_s: float = 0.0, to_s: float = float("inf"), should_stop: Callable[[], bool] = lambda: False
    ) -> ReplayedToBus:
        """Say what is in a span, and return what was said."""
        self._sought_s = from_s
        while self._sought_s is not None:
            begin_s, self._sought_s = self._sought_s, None
            self._say(said_in(self._session, from_s=begin_s, to_s=to_s), should_stop)
        return ReplayedToBus(n_by_topic=dict(self._n), seconds=self._seconds, late_ms=self._late_ns / 1e6)

    def _say(self, said: Iterator[Said], should_stop: Callable[[], bool]) -> None:
        begun_ns = first_ns = None
        for one in said:
            if begun_ns is None or first_ns is None:
                begun_ns, first_ns = self._now_ns(), one.log_ns
            due_ns = begun_ns + round((one.log_ns - first_ns) / self._rate)
            if self._is_cut_off(due_ns, should_stop):
                return
            self._late_ns = max(self._late_ns, self._now_ns() - due_ns)
            self._put(one.topic, self._as_now(one, due_ns), due_ns)
            self._n[one.topic.name] = self._n.get(one.topic.name, 0) + 1
            self._seconds = max(self._seconds, (one.log_ns - first_ns) / 1e9)

    def _as_now(self, one: Said, due_ns: int) -> Any:  # noqa: ANN401 - of the topic's kind
        """Return a message whose own stamp is as old as it was then."""
        stamp_ns = getattr(one.message, "stamp_ns", None)
        if stamp_ns is None or self._session.about.get("clock") != "host":
            return one.message
        return msgspec.structs.replace(one.message, stamp_ns=due_ns - round((one.log_ns - stamp_ns) / self._rate))

    def _is_cut_off(self, due_ns: int, should_stop: Callable[[], bool]) -> bool:
        """Wait until a time; return whether somebody wants something else by then."""
        while True:
            if should_stop() or self._sought_s is not None:
                return True
            rest_s = (due_ns - self._now_ns()) / 1e9
            if rest_s <= 0.0:
                return False
            self._wait(min(rest_s, LOOK_S))


def replay_to_bus(
    path: Path, *, endpoint: str = ENDPOINT, rate: float = 1.0, from_s: float = 0.0, to_s: float = float("inf"),
    should_stop: Callable[[], bool] = lambda: False,
) -> ReplayedToBus:  # fmt: skip
    """Open a bus and say a session there.

    Args:
        path: of the session.
        endpoint: where the bus is opened; nobody may listen there yet.
        rate: how many times as fast as it was.
        from_s: seconds since the session's beginning.
        to_s: the same.
        should_stop: whether somebody asked to end.

    Raises:
        UnfitError: the session says nothing of the kind.
        BusError: somebody listens at that endpoint.
    """
    with SessionFile(path) as session, ExitStack() as stack:
        if next(said_in(session, from_s=from_s, to_s=to_s), None) is None:
            raise UnfitError(f"{path}: expected messages of {', '.join(t.name for t in REPLAYED)}, there are none")
        serial = session.about.get("serial") or "replayed"
        hub = stack.enter_context(Bus(endpoint, serial=serial, role=Role.ROBOT, source="replay", is_hub=True))
        buses = {Role.ROBOT: hub}
        publishers: dict[str, Publisher[Any]] = {}

        def put(topic: Topic[Any], message: Any, stamp_ns: int) -> None:  # noqa: ANN401 - of the topic's kind
            if topic.name not in publishers:
                role = Role.ROBOT if Role.ROBOT in topic.writers else topic.writers[0]
                if role not in buses:
                    buses[role] = stack.enter_context(Bus(endpoint, serial=serial, role=role, source=f"re_{role}"))
                publishers[topic.name] = buses[role].publisher(topic)
            publishers[topic.name].put(message, stamp_ns=stamp_ns)

        return BusReplay(session, put, rate=rate).run(from_s=from_s, to_s=to_s, should_stop=should_stop)
