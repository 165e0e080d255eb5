"""A sweep: which learners, on which tables and rigs, with which seeds. Shipped ones lie in config/sweeps."""

from typing import Annotated

from msgspec import Meta

from config.values import Name, Section

__all__ = ["Sweep"]

Source = Annotated[str, Meta(min_length=1, max_length=500)]
"""A shipped file's name, or a path."""
Sources = Annotated[tuple[Source, ...], Meta(min_length=1, max_length=100)]


class Sweep(Section, frozen=True, kw_only=True):
    """Every learner on every table and rig with every seed: a cell each."""

    name: Name
    description: str = ""
    presets: Sources = ("default",)
    scenarios: Sources = ("paper",)
    rigs: Sources = ("twin",)
    """In lock-step: what runs by the wall clock has one arm, and cannot be run several times side by side."""
    seeds: Annotated[tuple[Annotated[int, Meta(ge=0)], ...], Meta(min_length=1, max_length=10_000)]
    epochs: Annotated[int, Meta(ge=1, le=1_000_000)] | None = None
    """In place of each learner's own number."""
    judged: bool = True
    """Evaluate densely, 20 test epochs a goal."""
    tries: Annotated[int, Meta(ge=1, le=100)] = 3
    """Starts of a cell that come no further than the one before, after which it is given up and reported."""
    cell_memory_mb: Annotated[int, Meta(ge=200, le=1_000_000)] = 2000
    """A cell that takes more is ended, and has failed."""
