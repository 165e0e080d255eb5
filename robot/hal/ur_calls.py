"""Calls of the client library made fit for this package: errors that say who did not answer, and an end in time."""

import faulthandler
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from robot.errors import WireError

__all__ = ["bounded", "named"]


@contextmanager
def named(what: str, address: str) -> Iterator[None]:
    """Turn what the client throws, which is of one kind for all, into an error that says who did not answer.

    Raises:
        WireError: the client threw.
    """
    try:
        yield
    except RuntimeError as error:
        raise WireError(f"{what}: expected an answer at {address}, got: {error}") from error


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
