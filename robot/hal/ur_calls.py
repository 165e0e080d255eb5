"""Calls of the client library made fit for this package: errors that say who did not answer, and an end in time."""

import faulthandler
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from robot.errors import WireError

__all__ = ["bounded", "named", "what_to_try"]

HINTS = (
    ("start control script", "is it in remote control, and do its ports 30001 to 30003 answer?"),
    ("host not found", "is the address right? a name must be known to this machine, numbers always are"),
    ("refused", "is it up, and is that service enabled on the pendant (Settings, Security, Services)?"),
)
"""What to try, by what the client says."""
TRY_ELSE = "is it up and its address right, does it answer a ping, and is that service enabled on the pendant?"


@contextmanager
def named(what: str, address: str) -> Iterator[None]:
    """Turn what the client throws, which is of one kind for all, into an error that says who did not answer.

    Raises:
        WireError: the client threw.
    """
    try:
        yield
    except RuntimeError as error:
        said = str(error)
        raise WireError(
            f"{what}: expected an answer at {address}, got: {said.rstrip('. ')}; {what_to_try(said)}"
        ) from error


def what_to_try(said: str) -> str:
    """Return what somebody may try where a connection failed with these words."""
    return next((hint for words, hint in HINTS if words in said.lower()), TRY_ELSE)


@contextmanager
def bounded(limit_s: float | None) -> Iterator[None]:
    """End this process where something takes too long that lets no other thread of ours run meanwhile.

    Args:
        limit_s: how long it may take; None: as long as it likes.
    """
    if limit_s is None:
        yield
        return
    with Path("/dev/null").open("w") as nowhere:
        faulthandler.dump_traceback_later(limit_s, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
