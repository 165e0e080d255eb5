"""The cells of a sweep: one run each, with a folder of its own. Pure but for a look at how far a folder's run has come.

A cell is nothing but the `autotelic learn` of its words: whoever runs it, it comes to the same bytes.
"""

from itertools import product
from pathlib import Path, PurePath

import msgspec

from config.sweep import Sweep

__all__ = ["Cell", "cells_of", "epochs_done", "is_finished", "words_of"]

SUMMARY_NAME = "summary.json"
"""A run writes it when all its epochs are done."""
TAIL_BYTES = 4096


class Cell(msgspec.Struct, frozen=True, kw_only=True):
    """One run of a sweep."""

    name: str
    """Of its folder."""
    scenario: str
    preset: str
    rig: str
    seed: int


def cells_of(sweep: Sweep) -> tuple[Cell, ...]:
    """Return the cells, seed by seed: what is done first tells of every learner."""
    return tuple(
        Cell(name=_name(scenario, preset, rig, seed), scenario=scenario, preset=preset, rig=rig, seed=seed)
        for seed, scenario, preset, rig in product(sweep.seeds, sweep.scenarios, sweep.presets, sweep.rigs)
    )


def words_of(cell: Cell, sweep: Sweep, folder: Path) -> tuple[str, ...]:
    """Return the command that runs a cell from wherever it is."""
    return (
        "learn", "--scenario", cell.scenario, "--preset", cell.preset, "--rig", cell.rig, "--seed", str(cell.seed),
        *(() if sweep.epochs is None else ("--epochs", str(sweep.epochs))), *(("--judged",) if sweep.judged else ()),
        "--out", str(folder / cell.name), "--workers", "0", "--resume", "--json",
    )  # fmt: skip


def is_finished(cell: Cell, folder: Path) -> bool:
    """Whether a cell's run has done all its epochs."""
    return (folder / cell.name / SUMMARY_NAME).is_file()


def epochs_done(cell: Cell, folder: Path) -> int:
    """Return how many epochs a cell's tables tell of; a run that is taken up again may go back a few."""
    path = folder / cell.name / "trials.csv"
    try:
        with path.open("rb") as table:
            table.seek(max(0, path.stat().st_size - TAIL_BYTES))
            last = table.read().rsplit(b"\n", 2)[-2]
        return int(last.split(b",", 1)[0]) + 1
    except (OSError, ValueError, IndexError):
        return 0


def _name(*parts: str | int) -> str:
    return "-".join(part if isinstance(part, str) and "/" not in part else PurePath(str(part)).stem for part in parts)
