"""One process on the bus: who it is, what it may write, and its link to the others."""

from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic_ns
from types import TracebackType
from typing import Self, TypeVar
from weakref import finalize

import msgspec
import zenoh

from robot.bus.clock_number import clock_number
from robot.bus.codec import Codec
from robot.bus.envelope import check_source
from robot.bus.errors import BusConfigError, BusError
from robot.bus.inlet import Inlet, Received
from robot.bus.keys.guard import Guard, guard_of
from robot.bus.link import on_link, open_link
from robot.bus.outlet import Outlet
from robot.bus.ports import Publisher, Subscriber
from robot.bus.queries import Answerer, Asker, read_request
from robot.bus.topic import Query, Role, Topic, key_of
from robot.bus.topics import PING, Pong

__all__ = ["Bus"]

T = TypeVar("T", bound=msgspec.Struct)
Q = TypeVar("Q", bound=msgspec.Struct)
R = TypeVar("R", bound=msgspec.Struct)


class Bus:
    """A typed door to the bus. A link that breaks is made again with growing pauses, and everything goes on over it.

    One that nobody closes leaves when nobody holds it any more, or when the process ends.

    Args:
        endpoint: Where the hub listens.
        serial: Of the plant that all is about.
        role: What this process is for; it may write and answer what the table says this role does.
        source: Its name, by which others tell it from the rest; its role's where it is not given.
        is_hub: The others link to this process.
        keys: Folder of certificates, for an endpoint that asks for them.
        now_ns: This machine's monotonic clock.

    Attributes:
        serial: The plant's.
        source: This process's name.
        clock: Which clock it goes by (robot.bus.clock_number).
    """

    def __init__(
        self, endpoint: str, *, serial: str, role: Role, source: str = "", is_hub: bool = False,
        keys: str | None = None, now_ns: Callable[[], int] = monotonic_ns,
    ) -> None:  # fmt: skip
        self._endpoint, self._is_hub, self._keys = endpoint, is_hub, keys
        self.serial = serial
        self._role, self._now_ns = role, now_ns
        self.source = check_source(source or role)
        self.clock = clock_number()
        self._session: zenoh.Session | None = None
        self._leave: Callable[[], object] | None = None

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def open(self) -> None:
        """Listen, as the hub, or join; a second call does nothing.

        Raises:
            BusConfigError: the endpoint is none, or others could reach it; a certificate is missing or over.
            BusError: it is taken, or nobody there lets us in.
        """
        if self._session is None:
            self._session = session = open_link(self._endpoint, is_hub=self._is_hub, guard=self._guard())
            self._leave = finalize(self, _leave, session)
            self._answer_pings(session)

    def close(self) -> None:
        """Leave. Idempotent, never raises."""
        self._session = None
        leave, self._leave = self._leave, None
        if leave is not None:
            leave()

    @property
    def is_linked(self) -> bool:
        """Whether there is a link: to the hub, or to anybody where this process is the hub."""
        return self._session is not None and bool(self._session.info.transports())

    def publisher(self, topic: Topic[T]) -> Publisher[T]:
        """Return a way to write a topic.

        Raises:
            BusConfigError: it is another role's to write.
            BusError: the bus is not open.
        """
        self._check(topic.name, "written", topic.writers)
        return Publisher(self._opened(), self._key(topic.name), topic, self._outlet(topic.kind))

    def subscriber(self, topic: Topic[T], on_message: Callable[[Received[T]], None]) -> Subscriber[T]:
        """Hand each message of a topic to a function, on the bus's own thread, which must not be held up.

        Raises:
            BusError: the bus is not open.
        """
        inlet = Inlet(topic, reader=self.source, clock=self.clock)
        return Subscriber(
            self._opened(), self._key(topic.name), inlet, on_message=on_message, now_ns=self._now_ns
        )  # fmt: skip

    def answerer(self, query: Query[Q, R]) -> Answerer[Q, R]:
        """Return a way to answer a query.

        Raises:
            BusConfigError: it is another role's to answer.
            BusError: the bus is not open.
        """
        self._check(query.name, "answered", query.answered_by)
        outlet = self._outlet(query.reply)
        return Answerer(self._opened(), self._key(query.name), query, outlet=outlet, reader=self.source)

    def asker(self, query: Query[Q, R]) -> Asker[Q, R]:
        """Return a way to ask a query.

        Raises:
            BusConfigError: it is another role's to ask.
            BusError: the bus is not open.
        """
        self._check(query.name, "asked", query.asked_by)
        return Asker(
            self._opened(), self._key(query.name), query, outlet=self._outlet(query.request), reader=self.source,
            is_linked=lambda: self.is_linked,
        )  # fmt: skip

    def raw(self) -> zenoh.Session:
        """Return Zenoh's own session, for whoever looks at what is in no table.

        Raises:
            BusError: the bus is not open.
        """
        return self._opened()

    def _guard(self) -> Guard | None:
        if self._keys is None:
            return None
        return guard_of(Path(self._keys), self.source, is_hub=self._is_hub, now=datetime.now(UTC))

    def _outlet(self, kind: type[T]) -> Outlet[T]:
        return Outlet(kind, source=self.source, clock=self.clock, now_ns=self._now_ns)

    def _opened(self) -> zenoh.Session:
        if self._session is None:
            raise BusError(f"bus: expected to be open at {self._endpoint}, it is not: open it first")
        return self._session

    def _key(self, name: str) -> str:
        return key_of(self.serial, name)

    def _check(self, name: str, how: str, roles: tuple[Role, ...]) -> None:
        if self._role not in roles:
            raise BusConfigError(f"{name}: expected to be {how} by {' or '.join(roles)}, {self.source} is {self._role}")

    def _answer_pings(self, session: zenoh.Session) -> None:
        """Answer from now on. What answers must not hold this bus, which could never be let go of then."""
        codec, outlet = Codec(PING.request), self._outlet(PING.reply)
        source, role, clock, now_ns = self.source, self._role, self.clock, self._now_ns

        def answer(query: zenoh.Query) -> None:
            with query:
                try:
                    read_request(query, codec, name=PING.name, reader=source)
                except BusError as error:
                    query.reply_err(str(error))
                    return
                pong = Pong(source=source, role=role, clock=clock, now_ns=now_ns())
                payload, attachment = outlet.wrap(pong)
                query.reply(query.key_expr, payload, attachment=attachment)

        session.declare_queryable(self._key(PING.name), on_link(answer))


def _leave(session: zenoh.Session) -> None:
    with suppress(zenoh.ZError):
        session.close()
