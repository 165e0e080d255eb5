"""The flight recorder: the last half minute of all that a session hears, in a file of its own around every stop.

What is kept is bytes in memory. A stop has a thread write them: whoever records, or holds the arm, waits for nothing.
"""

from collections import deque
from collections.abc import Callable
from queue import SimpleQueue
from threading import Thread
from typing import Any, NamedTuple

import msgspec

from robot.bus.codec import Codec
from robot.bus.topic import Topic
from robot.errors import RobotError
from robot.recording.recorder import Recorder
from robot.recording.stops import StopsHeard
from robot.recording.topics import GOAL, RESET_MARK, SCENE, STATION, SUBGOAL

__all__ = ["AFTER_NS", "BEFORE_NS", "MOST_FILES", "Begin", "Flight", "FlightTicks"]

BEFORE_NS, AFTER_NS = 30_000_000_000, 2_000_000_000
MOST_BYTES = 1 << 28
"""Of what is kept; the oldest makes room."""
MOST_FILES = 100
HOLDING = tuple(topic.name for topic in (STATION, RESET_MARK, GOAL, SUBGOAL, SCENE))
"""Topics that are written on a change: the newest from before the half minute is in a stop's file, too."""

Begin = Callable[[str, int], Recorder]
"""Begins a file, told why the arm was stopped and when, by the session's clock."""


class _Kept(NamedTuple):
    """One message."""

    topic: Topic[Any]
    payload: bytes
    log_ns: int
    stamp_ns: int
    has_words: bool


class Flight:
    """Keeps what is heard, and writes it where the arm is stopped.

    Args:
        tell: is told in words when a file cannot be written, from a thread of its own.

    Attributes:
        n_files: Stops that were written.
    """

    def __init__(self, *, tell: Callable[[str], object] = lambda _: None) -> None:
        self._tell = tell
        self._kept: deque[_Kept] = deque()
        self._n_bytes = self._newest_ns = self._until_ns = self.n_files = 0
        self._holding: dict[str, _Kept] = {}
        self._stops = StopsHeard()
        self._begin: Begin | None = None
        self._open: SimpleQueue[_Kept | None] | None = None
        self._threads: list[Thread] = []

    def follow(self, begin: Begin) -> None:
        """Begin files like this from now on: another session is recorded."""
        self._begin = begin
        self._holding.clear()

    def heard(self, topic: Topic[Any], payload: bytes, *, log_ns: int, stamp_ns: int, has_words: bool) -> None:
        """Keep a message."""
        kept = _Kept(topic, payload, log_ns, stamp_ns, has_words)
        self._kept.append(kept)
        self._n_bytes += len(payload)
        self._newest_ns = max(self._newest_ns, log_ns)
        oldest_ns = self._newest_ns - BEFORE_NS
        while self._kept[0].log_ns < oldest_ns or self._n_bytes > MOST_BYTES:
            self._leave(self._kept.popleft())
        if self._open is not None:
            if log_ns > self._until_ns:
                self._end()
            else:
                self._open.put(kept)

    def _leave(self, kept: _Kept) -> None:
        """Forget a message, unless it is what still holds: what the station is, which goal."""
        self._n_bytes -= len(kept.payload)
        name = kept.topic.name
        if name in HOLDING and not (name == SCENE.name and name in self._holding):
            self._holding[name] = kept  # of a scene the first one, which has all there is

    def look(self, message: object, *, log_ns: int) -> None:
        """Look whether a message, already kept, tells of a stop; write what led to it then."""
        why = self._stops.why(message)
        if why is None:
            return
        self._until_ns = log_ns + AFTER_NS
        if self._open is None and self._begin is not None and self.n_files < MOST_FILES:
            self.n_files += 1
            self._open = SimpleQueue()
            thread = Thread(
                target=self._write,
                args=(self._begin, why, log_ns, [*self._holding.values(), *self._kept], self._open),
                name="flight",
            )
            self._threads = [t for t in self._threads if t.is_alive()] + [thread]
            thread.start()

    def close(self) -> None:
        """Finish what is being written. Idempotent."""
        self._end()
        for thread in self._threads:
            thread.join()

    def _end(self) -> None:
        if self._open is not None:
            self._open.put(None)
            self._open = None

    def _write(self, begin: Begin, why: str, at_ns: int, before: list[_Kept], more: SimpleQueue[_Kept | None]) -> None:
        try:
            recorder = begin(why, at_ns)
        except RobotError as error:
            self._tell(f"flight recorder: {error}")
            return
        for kept in sorted(before, key=lambda k: k.log_ns):
            _put(recorder, kept)
        while (kept := more.get()) is not None:
            _put(recorder, kept)
        recorder.close()


class FlightTicks:
    """Takes ticks for a flight recorder alone (robot.recording.taps.WritesBytes): a session has them thinned.

    Args:
        flight: keeps them.
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self._codecs: dict[type, Codec[Any]] = {}
        self._encode = msgspec.json.Encoder().encode

    def encoded(self, message: msgspec.Struct) -> bytes:
        """Return the payload of a message whose numbers are finite."""
        return self._encode(message)

    def write(self, topic: Topic[Any], message: msgspec.Struct, *, log_ns: int, stamp_ns: int | None = None) -> bytes:
        """Take a message, and return its payload."""
        codec = self._codecs.get(topic.kind)
        if codec is None:
            codec = self._codecs[topic.kind] = Codec(topic.kind)
        payload, _, has_words = codec.encode(message)
        stamp_ns = log_ns if stamp_ns is None else stamp_ns
        self.put(topic, payload, log_ns=log_ns, stamp_ns=stamp_ns, has_words=has_words)
        self._flight.look(message, log_ns=log_ns)
        return payload

    def put(self, topic: Topic[Any], payload: bytes, *, log_ns: int, stamp_ns: int, has_words: bool = False) -> None:
        """Take one as its bytes."""
        self._flight.heard(topic, payload, log_ns=log_ns, stamp_ns=stamp_ns, has_words=has_words)


def _put(recorder: Recorder, kept: _Kept) -> None:
    recorder.put(kept.topic, kept.payload, log_ns=kept.log_ns, stamp_ns=kept.stamp_ns, has_words=kept.has_words)
