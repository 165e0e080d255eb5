"""Keeps standard output for answers: libraries print there from C++ whenever they like, into what a script reads."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["chatter_to_stderr", "divert_chatter"]

OUT, ERR = 1, 2


@contextmanager
def chatter_to_stderr() -> Iterator[None]:
    """Send to standard error what is written to standard output meanwhile, by child processes too."""
    sys.stdout.flush()
    saved = os.dup(OUT)
    try:
        os.dup2(ERR, OUT)
        yield
    finally:
        sys.stdout.flush()
        os.dup2(saved, OUT)
        os.close(saved)


def divert_chatter() -> None:
    """The same for good, in a process that answers nobody on its standard output."""
    os.dup2(ERR, OUT)
