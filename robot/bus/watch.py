"""What a person sees of a bus: who is there, what they write, and topics that are in no table."""

from time import monotonic_ns, sleep
from typing import Generic, TypeVar

import msgspec
import zenoh

from robot.bus.errors import BusError
from robot.bus.inlet import Counts, Received
from robot.bus.link import on_link
from robot.bus.pace import Pace
from robot.bus.session import Bus
from robot.bus.topic import ROOT, Topic
from robot.bus.topics import PING, QUERIES, TOPICS, Ping, Pong

__all__ = ["Answer", "Heard", "Listener", "Seen", "ping_all", "survey"]

T = TypeVar("T", bound=msgspec.Struct)


class Heard(msgspec.Struct, frozen=True, kw_only=True):
    """One topic, as heard for a while."""

    name: str
    kind: str
    writers: tuple[str, ...]
    asked_hz: float | None
    heard_hz: float | None
    deadline_ms: float | None
    counts: Counts
    sources: tuple[str, ...]
    error: str = ""


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """A process that answered."""

    source: str
    role: str
    round_trip_ms: float
    is_same_clock: bool
    offset_ms: float = 0.0
    """Its clock less ours, when it answered: half the round trip is taken for the way back."""
    offset_within_ms: float = 0.0
    """It may be off by so much, whichever way took longer."""


class Seen(msgspec.Struct, frozen=True, kw_only=True):
    """A bus, as seen for a while."""

    processes: tuple[Answer, ...]
    topics: tuple[Heard, ...]
    unknown_keys: tuple[str, ...]


class Listener(Generic[T]):
    """Listens to one topic and keeps its pace.

    Args:
        bus: Open.
        topic: What is listened to.

    Attributes:
        pace: How often messages come, and how old.
    """

    def __init__(self, bus: Bus, topic: Topic[T]) -> None:
        self._topic, self.pace = topic, Pace()
        self._sources: set[str] = set()
        self._subscriber = bus.subscriber(topic, self._note)

    @property
    def counts(self) -> Counts:
        """What came so far."""
        return self._subscriber.counts

    @property
    def error(self) -> str:
        """What is wrong with the newest that came, in words."""
        return str(self._subscriber.error or "")

    def heard(self) -> Heard:
        """Return what was heard so far."""
        topic = self._topic
        return Heard(
            name=topic.name, kind=topic.kind.__name__, writers=tuple(topic.writers), asked_hz=topic.rate_hz,
            heard_hz=self.pace.rate_hz, counts=self.counts, sources=tuple(sorted(self._sources)), error=self.error,
            deadline_ms=None if topic.deadline_s is None else topic.deadline_s * 1e3,
        )  # fmt: skip

    def _note(self, received: Received[T]) -> None:
        self._sources.add(received.envelope.source)
        self.pace.note(received.arrived_ns, received.age_ns)


def ping_all(bus: Bus) -> tuple[Answer, ...]:
    """Ask who is there and return who answered within a second, the asker not among them."""
    answers: list[Answer] = []
    asker = bus.asker(PING)
    begun_ns = monotonic_ns()

    def note(pong: Pong) -> None:
        now_ns = monotonic_ns()
        round_trip_ms = (now_ns - begun_ns) / 1e6
        if pong.source != bus.source:
            answers.append(
                Answer(
                    source=pong.source, role=pong.role, round_trip_ms=round_trip_ms,
                    is_same_clock=pong.clock == bus.clock,
                    offset_ms=(pong.now_ns - (begun_ns + now_ns) / 2.0) / 1e6, offset_within_ms=round_trip_ms / 2.0,
                )
            )  # fmt: skip

    asker.ask_each(Ping(), note)
    return tuple(sorted(answers, key=lambda answer: answer.source))


def survey(bus: Bus, *, seconds: float) -> Seen:
    """Listen to everything for a while and return what there was.

    Raises:
        BusError: the bus is not open.
    """
    keys: set[str] = set()

    def note(sample: zenoh.Sample) -> None:
        keys.add(str(sample.key_expr))

    spy = bus.raw().declare_subscriber(f"{ROOT}/**", on_link(note))
    listeners = [Listener(bus, topic) for topic in TOPICS]
    sleep(seconds)
    heard = tuple(listener.heard() for listener in listeners)
    try:
        spy.undeclare()
    except zenoh.ZError as error:
        raise BusError(f"bus: expected an open bus, got: {error}") from error
    known = {f"{ROOT}/{bus.serial}/{row.name}" for row in (*TOPICS, *QUERIES)}
    return Seen(processes=ping_all(bus), topics=heard, unknown_keys=tuple(sorted(keys - known)))
