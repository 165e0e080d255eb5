"""What a report leaves: both panels of the paper's Figure 2, the curriculum, and the figures of merit. The edge."""

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from learning.figures import curriculum_figure, performance_figure, save
from learning.report import Report, Run, group_runs, report_of

__all__ = ["write_report"]


DRAWS_SEED = 0
"""Of the runs that are drawn anew for intervals: the same runs give the same report."""


def write_report(runs: Sequence[Run], folder: Path) -> tuple[Report, list[Path]]:
    """Draw the figures of runs, write them and their figures of merit, and return those and the files."""
    groups = group_runs(runs)
    report = report_of(groups, rng=np.random.default_rng(DRAWS_SEED))
    paths = [
        *save(performance_figure(groups), folder, "figure2"),
        *save(curriculum_figure(groups), folder, "curriculum"),
        folder / "summary.json",
    ]
    paths[-1].write_bytes(msgspec.json.format(msgspec.json.encode(report), indent=2) + b"\n")
    return report, paths
