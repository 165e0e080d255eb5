"""What a report leaves: both panels of the paper's Figure 2, the curriculum, and the figures of merit. The edge."""

from collections.abc import Sequence
from pathlib import Path

import msgspec

from learning.figures import curriculum_figure, performance_figure, save
from learning.report import Run, group_runs, report_of

__all__ = ["write_report"]


def write_report(runs: Sequence[Run], folder: Path) -> list[Path]:
    """Draw the figures of runs, write them and their figures of merit, and return the files."""
    groups = group_runs(runs)
    paths = [
        *save(performance_figure(groups), folder, "figure2"),
        *save(curriculum_figure(groups), folder, "curriculum"),
        folder / "summary.json",
    ]
    paths[-1].write_bytes(msgspec.json.format(msgspec.json.encode(report_of(groups)), indent=2) + b"\n")
    return paths
