"""Tries of what runs by the wall clock: begun anew where this machine, and nothing under test, was in the way."""

from collections.abc import Callable
from typing import TypeVar

from sim_twin.paired.machine import SPARE_SHARE, Spare

__all__ = ["CutShortError", "DisturbedError", "in_peace"]

N_TRIES = 6

T = TypeVar("T")


class DisturbedError(RuntimeError):
    """Something came up before anything was made to go wrong: this machine was busy elsewhere for too long."""


class CutShortError(RuntimeError):
    """Something came up that nothing was made to go wrong for, and this machine was not busy."""


def in_peace(name: str, attempt: Callable[[], T], *, told: list[str]) -> T:
    """Return what an attempt comes to; make it anew where it was disturbed.

    Args:
        name: what is tried.
        attempt: one try of it.
        told: gets what disturbed each try that was begun anew.

    Raises:
        DisturbedError: it was each time, and this machine was busy elsewhere.
        CutShortError: it was each time on a machine that had time to spare: no disturbance explains it.
    """
    n_spared = 0
    while len(told) < N_TRIES and 2 * n_spared <= N_TRIES:
        spare = Spare().begin()
        try:
            return attempt()
        except DisturbedError as error:
            share = spare.share()
            n_spared += share >= SPARE_SHARE
            told.append(f"{error} ({share:.0%} of the processors' time to spare)")
    error = CutShortError if 2 * n_spared > N_TRIES else DisturbedError
    raise error(f"{name}: {'; '.join(told)}")
