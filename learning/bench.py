"""The bench of learning: figures of merit of the newest run, or of the run or sweep given."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from time import perf_counter

import typer
from msgspec import UNSET

from learning.errors import LearningError
from learning.metrics import EraSummary, eras
from learning.report import Run, load_runs
from learning.run_folder import RunFolder
from robot.bench import BenchReport, BenchResult, bench_report

__all__ = ["bench_learning", "learning_results"]

RUNS = Path("runs")
LEARN_GOAL, RECOVER_GOAL, GRAPH_GOAL = 150, 100, 60
TRIALS_GOAL, SUCCESS_GOAL = 0.2, 0.98


def bench_learning(*, full: bool, run: Path | None = None) -> BenchReport:
    """Return the figures of a run folder, or of all runs in a folder; nothing is learnt here, full or not.

    Runs in a folder that cannot be read are named and left out, and make a row that misses its goal.
    """
    del full
    started_s = perf_counter()
    try:
        loaded = load_runs([run or _newest()])
    except LearningError as error:
        raise typer.BadParameter(str(error), param_hint="RUN") from error
    for line in loaded.lines():
        typer.echo(line, err=True)
    results = learning_results(loaded.runs, n_left_out=len(loaded.left_out))
    return bench_report("learning", results, seconds=perf_counter() - started_s)


def learning_results(runs: Sequence[Run], *, n_left_out: int = 0) -> list[BenchResult]:
    """Return the rows: medians over runs, goals asked of the worst run. What was not reached is not a number.

    A median over fewer than all says of how many in its row's details; a set of rules that a run is yet to come to
    counts as one not reached.
    """
    spans = [(run, eras(run.manifest.changes, run.manifest.n_epochs)) for run in runs]
    reached = [[*run.summary.eras, *[None] * (len(planned) - len(run.summary.eras))] for run, planned in spans]
    firsts = [era for of_run in reached for era in of_run[:1]]
    laters = [era for of_run in reached for era in of_run[1:]]
    every = [*firsts, *laters]
    return [
        _row("runs", [float(len(runs))], "runs"),
        _row("runs_left_out", [float(n_left_out)], "runs", at_most=0),
        _row("epoch_all_goals", _each(firsts, lambda era: era.learnt_after), "epochs", at_most=LEARN_GOAL),
        _row("epochs_to_recover", _each(laters, lambda era: era.learnt_after), "epochs", at_most=RECOVER_GOAL),
        _row("trials_over_optimum", _each(every, lambda era: era.trials_over_optimum), "trials", at_most=TRIALS_GOAL),
        _row(
            "trials_over_optimum_worst_goal",
            _each(every, lambda era: era.trials_over_optimum_worst),
            "trials",
            at_most=TRIALS_GOAL,
        ),
        _row("least_success_at_end", _each(every, _success), "share", at_least=SUCCESS_GOAL),
        _row("time_steps_to_all", [run.summary.time_steps_to_all for run in runs], "decisions"),
        _row("graph_right_at_first_epochs", _each(firsts, lambda era: era.graph_right_after), "epochs"),
        _row(
            "graph_right_after_epochs", _each(laters, lambda era: era.graph_right_after), "epochs", at_most=GRAPH_GOAL
        ),
    ]


def _each(parts: Sequence[EraSummary | None], figure: Callable[[EraSummary], float | None]) -> list[float | None]:
    """Return one figure of every set of rules; None of those that were not come to."""
    return [None if part is None else figure(part) for part in parts]


def _success(era: EraSummary) -> float | None:
    """Success of the goal that has the least at the end of an era."""
    shares = [share for share in era.success_by_goal if share is not None]
    return min(shares) if shares else None


def _row(
    name: str,
    values: Sequence[float | None],
    unit: str,
    *,
    at_most: float | None = None,
    at_least: float | None = None,
) -> BenchResult:
    known = [value for value in values if value is not None]
    is_reached = bool(values) and len(known) == len(values)
    ok = is_reached or (at_most is None and at_least is None)
    if at_most is not None:
        ok = is_reached and max(known) <= at_most
    if at_least is not None:
        ok = is_reached and min(known) >= at_least
    goal = "" if at_most is None else f"<= {at_most:g}"
    goal = goal if at_least is None else f">= {at_least:g}"
    few = {"over": f"{len(known)} of {len(values)}"} if len(known) < len(values) else UNSET
    value = median(known) if known else math.nan
    return BenchResult(name=name, value=value, unit=unit, goal=goal, ok=ok, details=few)


def _newest() -> Path:
    """Return the run folder under runs/ that was begun last."""
    folders = [path.parent for path in RUNS.glob("**/run.json") if RunFolder(path.parent).holds_run()]
    if not folders:
        raise typer.BadParameter(f"expected a run folder, there is none under {RUNS}/", param_hint="RUN")
    return max(folders, key=lambda folder: (folder / "run.json").stat().st_mtime_ns)
