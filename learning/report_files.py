"""What a report leaves: figures to print, the figures of merit, and one page that holds all of it. The edge."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np
from matplotlib.figure import Figure

from config.errors import ConfigError
from config.learning import LearningConfig
from learning.checkpoint import write_atomically
from learning.errors import LearningError
from learning.figure_style import save
from learning.figures import ABREAST, curriculum_figure, performance_figure
from learning.figures_compared import epochs_figure, improvement_figure, learners_figure
from learning.page import Picture, page
from learning.report import Group, Report, Run, group_runs, report_of
from learning.run_folder import RunFolder

__all__ = ["learners_of", "write_report"]

DRAWS_SEED = 0
"""Of the runs that are drawn anew for intervals: the same runs give the same report."""


def write_report(
    runs: Sequence[Run], folder: Path, *, learners: Mapping[str, LearningConfig] | None = None
) -> tuple[Report, list[Path]]:
    """Draw the figures of runs, write them, their figures of merit and the page, and return the report and the files.

    Args:
        runs: read back from their folders.
        folder: what is written goes there.
        learners: what each group's learner is made of; None looks it up in the runs' folders.
    """
    groups = group_runs(runs)
    report = report_of(groups, rng=np.random.default_rng(DRAWS_SEED))
    pictures: list[Picture] = []
    paths: list[Path] = []
    for name, says, figure in _figures(groups, report):
        written = save(figure, folder, name)
        paths += written
        svg = next(path for path in written if path.suffix == ".svg").read_text(encoding="utf-8")
        pictures.append(Picture(name=name, says=says, svg=svg))
    whole = page(report, groups, pictures, learners_of(runs) if learners is None else learners)
    for name, content in (
        ("summary.json", msgspec.json.format(msgspec.json.encode(report), indent=2) + b"\n"),
        ("report.html", whole.encode()),
    ):
        write_atomically(folder / name, content)
        paths.append(folder / name)
    return report, paths


def learners_of(runs: Sequence[Run]) -> dict[str, LearningConfig]:
    """Return what each group's learner is made of, as its first run's folder tells, where it can."""
    found: dict[str, LearningConfig] = {}
    for group in group_runs(runs):
        try:
            found[group.name] = RunFolder(Path(group.runs[0].folder)).config().learning
        except (ConfigError, LearningError):
            continue
    return found


def _figures(groups: Sequence[Group], report: Report) -> list[tuple[str, str, Figure]]:
    """Return every figure with its name and what it shows."""
    made: list[tuple[str, str, Figure]] = []
    for i in range(0, len(groups), ABREAST):
        part = groups[i : i + ABREAST]
        names, after = " and ".join(group.name for group in part), "" if i == 0 else f"-{i // ABREAST + 1}"
        said = f"{names}: success of each goal's test epochs (top) and trials needed (bottom) over epochs."
        made.append((f"figure2{after}", said, performance_figure(part)))
        said = f"{names}: goals chosen by the first run (top), shares of choices over all runs (bottom)."
        made.append((f"curriculum{after}", said, curriculum_figure(part)))
    if sum(len(group.runs) for group in groups) == 1:
        return made
    said = (
        "All goals together: success and trials over the optimum, interquartile mean over goals and runs, 95 % interval"
        " by bootstrap stratified by goal."
    )
    made.append(("learners", said, learners_figure(groups)))
    made.append(("epochs", "Epochs until every goal was mastered, by learner and rules.", epochs_figure(report)))
    against = [row for row in report.comparisons if row.ours == groups[0].name and (row.success or row.trials)]
    if against:
        said = f"How surely a run of {groups[0].name} is better than one of another learner."
        made.append(("improvement", said, improvement_figure(against)))
    return made
