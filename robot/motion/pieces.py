"""Work that may be done piece by piece: a generator, which yields where it may be left for the next tick.

What came of it is what it returns. Whoever has the time takes it whole.
"""

from collections.abc import Generator
from typing import TypeVar

__all__ = ["Pieces", "padded", "whole"]

T = TypeVar("T")
Pieces = Generator[None, None, T]


def whole(pieces: Pieces[T]) -> T:
    """Do all that is left at once, and return what came of it."""
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            return end.value


def padded(pieces: Pieces[T], n: int) -> Pieces[T]:
    """Yield n times at the least, so that it takes as long whatever there was to do."""
    n_done = 0
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            came: T = end.value
            break
        n_done += 1
        yield
    for _ in range(n - n_done):
        yield
    return came
