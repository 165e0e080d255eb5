"""Who runs jobs, by the word that a person typed."""

import os
from pathlib import Path

import typer

from learning.sweeping.executor import Executor
from learning.sweeping.local import LocalExecutor
from learning.sweeping.on_ray import RayExecutor

__all__ = ["checked_place", "make_executor"]

HERE, RAY = "here", "ray"


def checked_place(on: str) -> str:
    """Return where jobs are to run, as it was typed.

    Raises:
        BadParameter: it is no such place.
    """
    if on not in (HERE, RAY) and not (on.startswith(f"{RAY}:") and on != f"{RAY}:"):
        raise typer.BadParameter(f"expected {HERE}, {RAY} or {RAY}:ADDRESS, got {on}", param_hint="--on")
    return on


def make_executor(on: str, jobs: int | None, logs: Path) -> Executor:
    """Return who runs jobs at a checked place, so many at a time; one a processor where None.

    Raises:
        LearningError: there is no such cluster, or Ray is not installed.
    """
    if on == HERE:
        return LocalExecutor(n_slots=jobs or len(os.sched_getaffinity(0)), logs=logs)
    _, _, address = on.partition(":")
    return RayExecutor(address=address or None, n_slots=jobs, logs=logs)
