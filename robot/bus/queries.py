"""Typed questions and answers over the bus."""

from collections.abc import Callable
from typing import Generic, TypeVar

import msgspec
import zenoh

from robot.bus.codec import Codec
from robot.bus.envelope import unpack
from robot.bus.errors import BusError, MalformedError, SchemaError
from robot.bus.outlet import Outlet
from robot.bus.topic import Query

__all__ = ["Answerer", "Asked", "Asker", "read_request"]

Q = TypeVar("Q", bound=msgspec.Struct)
R = TypeVar("R", bound=msgspec.Struct)

N_WAITING = 8


def read_request(query: zenoh.Query, codec: Codec[Q], *, name: str, reader: str) -> Q:
    """Return what a query asks.

    Raises:
        MalformedError: it is no such request.
        SchemaError: it was written with another version of its type.
    """
    attachment = b"" if query.attachment is None else query.attachment.to_bytes()
    payload = b"" if query.payload is None else query.payload.to_bytes()
    return _read(payload, attachment, codec, name=name, reader=reader)


class Asked(Generic[Q, R]):
    """One question that waits for its answer. It is answered once.

    Attributes:
        request: What is asked.
    """

    def __init__(self, query: zenoh.Query, request: Q, outlet: Outlet[R]) -> None:
        self.request = request
        self._query, self._outlet = query, outlet

    def answer(self, reply: R) -> None:
        """Answer."""
        payload, attachment = self._outlet.wrap(reply)
        with self._query:
            self._query.reply(self._query.key_expr, payload, attachment=attachment)

    def refuse(self, why: str) -> None:
        """Answer by an error in words."""
        with self._query:
            self._query.reply_err(why)


class Answerer(Generic[Q, R]):
    """Answers one query, by polling. What is no request is refused before anybody sees it.

    Args:
        session: Of the bus.
        key: Where.
        query: What.
        outlet: Wraps the answers.
        reader: Who answers, for the words.
    """

    def __init__(self, session: zenoh.Session, key: str, query: Query[Q, R], *, outlet: Outlet[R], reader: str) -> None:
        self._name, self._reader, self._outlet = query.name, reader, outlet
        self._codec = Codec(query.request)
        self._queryable = session.declare_queryable(key, zenoh.handlers.FifoChannel(N_WAITING))

    def next(self) -> Asked[Q, R] | None:
        """Return what was asked next, None where nothing was or where it was refused here."""
        query = self._queryable.try_recv()
        if query is None:
            return None
        try:
            request = read_request(query, self._codec, name=self._name, reader=self._reader)
        except (MalformedError, SchemaError) as error:
            with query:
                query.reply_err(str(error))
            return None
        return Asked(query, request, self._outlet)


class Asker(Generic[Q, R]):
    """Asks one query.

    Args:
        session: Of the bus.
        key: Where.
        query: What.
        outlet: Wraps the questions.
        reader: Who asks, for the words.
        is_linked: Tells whether there is a link to the hub.
    """

    def __init__(
        self, session: zenoh.Session, key: str, query: Query[Q, R], *, outlet: Outlet[Q], reader: str,
        is_linked: Callable[[], bool],
    ) -> None:  # fmt: skip
        self._session, self._key, self._query = session, key, query
        self._outlet, self._reader, self._is_linked = outlet, reader, is_linked
        self._codec = Codec(query.reply)

    def ask(self, request: Q) -> R:
        """Ask, and return the first answer.

        Raises:
            BusError: nobody answers, or the answer is an error.
            SchemaError: it was written with another version of its type.
        """
        answers: list[R] = []
        self.ask_each(request, answers.append)
        if answers:
            return answers[0]
        name, answer_s = self._query.name, self._query.answer_s
        if not self._is_linked():
            raise BusError(f"{name}: expected a link to the bus's hub, it is down; does the hub's process run?")
        raise BusError(f"{name}: expected an answer within {answer_s:g} s, none came; does the twin run?")

    def ask_each(self, request: Q, on_reply: Callable[[R], None]) -> None:
        """Ask everybody, and hand on each answer as it comes, until all have answered or time is over.

        Raises:
            BusError: an answer is an error.
            SchemaError: one was written with another version of its type.
        """
        payload, attachment = self._outlet.wrap(request)
        try:
            replies = self._session.get(
                self._key, payload=payload, attachment=attachment, timeout=self._query.answer_s,
                target=zenoh.QueryTarget.ALL, consolidation=zenoh.ConsolidationMode.NONE,
            )  # fmt: skip
        except zenoh.ZError as error:
            raise BusError(f"{self._query.name}: expected an open bus, got: {error}") from error
        for reply in replies:
            on_reply(self._read(reply))

    def _read(self, reply: zenoh.Reply) -> R:
        ok, error, name = reply.ok, reply.err, self._query.name
        if ok is None:
            said = "an error" if error is None else error.payload.to_string()
            raise BusError(said if said.startswith(f"{name}: ") else f"{name}: {said}")
        attachment = b"" if ok.attachment is None else ok.attachment.to_bytes()
        return _read(ok.payload.to_bytes(), attachment, self._codec, name=name, reader=self._reader)


def _read(payload: bytes, attachment: bytes, codec: Codec[Q], *, name: str, reader: str) -> Q:
    try:
        envelope, beside = unpack(attachment)
        codec.check_schema(envelope.origin, name=name, reader=reader)
        return codec.decode(payload, beside, has_words=envelope.has_words)
    except MalformedError as error:
        raise MalformedError(f"{name}: {error}") from error
