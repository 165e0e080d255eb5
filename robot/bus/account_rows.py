"""What crosses the bus between a learner that gives an account of itself and a recorder that writes it down."""

import msgspec

__all__ = ["AccountPart", "AccountWritten"]


class AccountPart(msgspec.Struct, frozen=True, kw_only=True):
    """One message of a learner's account, as it goes into a session's file."""

    account: int
    """Another number for a learner that was started anew."""
    number: int
    """The how many-th of its account, from 0."""
    oldest: int
    """Number of the oldest part that can still be told again."""
    topic: str
    """Of the session's file."""
    log_ns: int
    """By the teller's clock, and never before that of the part before."""
    stamp_ns: int
    has_words: bool = False
    payload: bytes
    """The message, encoded."""


class AccountWritten(msgspec.Struct, frozen=True, kw_only=True):
    """How far a recorder has written an account down; what is not, is told again."""

    account: int
    number: int
    """All parts up to this one are in a file; -1 where none is."""
    is_open: bool
    """It has heard an opening of this account: what it writes can be replayed."""
