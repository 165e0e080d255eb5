"""The part of `autotelic bench wire` that reads a run folder: what was learnt in lock-step, tested over the wire."""

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import typer
from rich.console import Console

from config.errors import ConfigError
from learning.errors import LearningError
from learning.progress import Status
from learning.rows import EvaluationRow
from learning.run_folder import RunFolder
from robot.bench import BenchResult

__all__ = ["success_results", "success_rows"]

SUCCESS_GOAL = 0.95


def success_rows(run: Path, *, rig: Path, n_tests: int) -> list[BenchResult]:
    """Test a run's newest checkpoint on a rig, every goal, under the rules that it learnt with last.

    What it learnt under rules of before it has unlearnt: those are tested with a run that ended before they changed.

    Args:
        run: a run's folder.
        rig: the rig's file; its controller runs.
        n_tests: test epochs a goal.

    Raises:
        BadParameter: this is no run folder, or it does not fit the rig.
    """
    from learning.assess import assess  # brings torch, seconds that other benches do not need

    folder = RunFolder(run)
    console = Console(stderr=True)
    try:
        goals = [goal.name for goal in folder.manifest().goals]
        console.print(f"{len(goals)} goals, {n_tests} test epochs each, 4 to 8 s a test epoch")
        with Status("connecting", now_s=perf_counter, console=console) as status:
            rows = assess(folder, n_tests=n_tests, seed=None, rules_epoch=None, rig=str(rig), tell=status).rows
    except (LearningError, ConfigError) as error:
        raise typer.BadParameter(str(error), param_hint="RUN") from error
    return success_results(rows, goals)


def success_results(rows: Sequence[EvaluationRow], goals: Sequence[str]) -> list[BenchResult]:
    """Return a row a goal: the share of test epochs in which it was achieved; one cut short failed."""
    return [
        BenchResult(
            name=f"success_{goals[row.goal]}",
            value=row.success,
            unit="share",
            goal=f">= {SUCCESS_GOAL:g}",
            ok=row.success >= SUCCESS_GOAL,
            details={
                "achieved": f"{row.n_successes} of {row.n_all}",
                "void": str(row.n_void),
                "rules of epoch": str(row.rules_epoch),
            },
        )
        for row in rows
    ]
