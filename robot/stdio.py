"""Redirects standard output at the descriptor: libraries write there from C++, into what a script reads."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["STDERR", "STDOUT", "redirected_stdout"]

STDOUT, STDERR = 1, 2


@contextmanager
def redirected_stdout(descriptor: int) -> Iterator[None]:
    """Send to another descriptor what is written to standard output meanwhile, by child processes too."""
    sys.stdout.flush()
    saved = os.dup(STDOUT)
    try:
        os.dup2(descriptor, STDOUT)
        yield
    finally:
        sys.stdout.flush()
        os.dup2(saved, STDOUT)
        os.close(saved)
