"""A learner's account on its way to whoever writes it down: numbered, kept until it is written, told again. State.

A link may lose, double or reorder what is told, and a recorder may be killed and started anew: what it has not said
that it wrote is kept here, and told again as long as somebody writes at all.
"""

from collections import deque
from collections.abc import Callable
from threading import Condition
from typing import Any

import msgspec

from robot.bus.account_rows import AccountPart, AccountWritten
from robot.bus.codec import Codec
from robot.bus.topic import Topic

__all__ = ["Account"]

AGAIN_NS, DEAF_NS = 500_000_000, 3_000_000_000
"""When a part that nobody wrote is told again, and after how long without a word nobody is believed to write."""
FIRST_S = 0.7
"""How long a word of a recorder is waited for at the end, where none has come yet."""
MOST_AGAIN, MOST_BYTES = 300, 1 << 26
"""Parts that are told again at a time, and payloads that are kept; the oldest make room."""


class Account:
    """Numbers and keeps what is told.

    Args:
        number: of the account, another for every process.
        put: tells one part; may lose it.
        now_ns: this process's monotonic clock.
    """

    def __init__(self, number: int, *, put: Callable[[AccountPart], object], now_ns: Callable[[], int]) -> None:
        self._account, self._put, self._now_ns = number, put, now_ns
        self._kept: deque[AccountPart] = deque()
        self._codecs: dict[type, Codec[Any]] = {}
        self._n = self._n_bytes = self._log_ns = 0
        self._told_ns = 0
        """When the oldest that is kept was told last."""
        self._heard_ns: int | None = None
        self._is_open, self._opening = True, -1
        self._changed = Condition()

    @property
    def n_waiting(self) -> int:
        """Parts that nobody has written yet, as far as is known."""
        return len(self._kept)

    @property
    def is_heard(self) -> bool:
        """Whether somebody writes."""
        return self._heard_ns is not None and self._now_ns() - self._heard_ns < DEAF_NS

    def write(self, topic: Topic[Any], message: msgspec.Struct, *, log_ns: int, stamp_ns: int | None = None) -> bytes:
        """Tell a message of a session's topic, and return its payload."""
        payload, beside, has_words = self._codec(topic.kind).encode(message)
        assert not beside, f"{topic.name}: messages with a field of bytes are not told as they are"
        stamp_ns = log_ns if stamp_ns is None else stamp_ns
        self.tell(topic.name, payload, log_ns=log_ns, stamp_ns=stamp_ns, has_words=has_words)
        return payload

    def tell(self, topic: str, payload: bytes, *, log_ns: int, stamp_ns: int, has_words: bool = False) -> None:
        """Tell what is encoded already, and again what was lost of what came before."""
        with self._changed:
            self._log_ns = max(self._log_ns, log_ns)
            part = AccountPart(
                account=self._account, number=self._n, oldest=self._kept[0].number if self._kept else self._n,
                topic=topic, log_ns=self._log_ns, stamp_ns=stamp_ns, has_words=has_words, payload=payload,
            )  # fmt: skip
            self._n += 1
            if not self._kept:
                self._told_ns = self._now_ns()
            self._kept.append(part)
            self._n_bytes += len(payload)
            while self._n_bytes > MOST_BYTES and len(self._kept) > 1:
                self._n_bytes -= len(self._kept.popleft().payload)
        self._put(part)
        self.tell_again()

    def tell_again(self) -> None:
        """Tell once more what nobody has written for a while, the oldest first."""
        with self._changed:
            now_ns = self._now_ns()
            is_due = self._kept and self.is_heard and now_ns - self._told_ns >= AGAIN_NS
            if not is_due:
                return
            self._told_ns = now_ns
            oldest = self._kept[0].number
            again = [msgspec.structs.replace(part, oldest=oldest) for part in list(self._kept)[:MOST_AGAIN]]
        for part in again:
            self._put(part)

    def take(self, written: AccountWritten) -> None:
        """Take in how far a recorder has come. Called on the bus's thread."""
        if written.account != self._account:
            return
        with self._changed:
            self._heard_ns = self._now_ns()
            self._is_open = written.is_open or written.number < self._opening
            while self._kept and self._kept[0].number <= written.number:
                self._n_bytes -= len(self._kept.popleft().payload)
                self._told_ns = self._heard_ns
            self._changed.notify_all()

    def begin(self) -> None:
        """Note that what is told next is an opening: none is wanted until it is written."""
        self._is_open, self._opening = True, self._n

    @property
    def wants_opening(self) -> bool:
        """Whether somebody writes who has heard no opening of it: he was started, or started anew, in its midst."""
        return self.is_heard and not self._is_open

    def finish(self, *, within_s: float, look_s: float = 0.1) -> bool:
        """Wait until all is written, as long as somebody writes; return whether it is."""
        begun_ns = self._now_ns()
        end_ns, first_ns = begun_ns + round(within_s * 1e9), begun_ns + round(FIRST_S * 1e9)
        while self._kept and self._now_ns() < (end_ns if self.is_heard else first_ns):
            with self._changed:
                self._changed.wait_for(lambda: not self._kept, look_s)
            self.tell_again()
        return not self._kept

    def _codec(self, kind: type[msgspec.Struct]) -> Codec[Any]:
        codec = self._codecs.get(kind)
        if codec is None:
            codec = self._codecs[kind] = Codec(kind)
        return codec
