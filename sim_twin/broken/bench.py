"""`autotelic bench faults`: each fault against an arm under way through the whole backend, one row a fault."""

from time import perf_counter

from rich.console import Console

from robot.bench import BenchReport, BenchResult, bench_report
from sim_twin.broken.course import Course
from sim_twin.broken.outcome import Outcome
from sim_twin.broken.trials import TOLD_S, TRIALS, Trial
from sim_twin.broken.tries import CutShortError, DisturbedError

__all__ = ["bench_faults"]

HOST = "127.0.0.30"


def bench_faults(*, full: bool) -> BenchReport:
    """Put an arm under way through each fault of a virtual controller.

    Args:
        full: all faults (some 10 min); otherwise those of a cut, a freeze, a hang and a safeguard.
    """
    begun = perf_counter()
    with Course(HOST) as course:
        results = _rows(course, [trial for trial in TRIALS if full or trial.is_brief])
    return bench_report("faults", results, seconds=perf_counter() - begun)


def _rows(course: Course, trials: list[Trial]) -> list[BenchResult]:
    """Return each fault's row; tell meanwhile, on the terminal's second channel, how far it has come."""
    console, results = Console(stderr=True, highlight=False), list[BenchResult]()
    for k, trial in enumerate(trials, start=1):
        console.print(f"{k} of {len(trials)}: {trial.name}")
        results.append(_row(course, trial))
        if not results[-1].ok:
            console.print(f"  {results[-1].details}", markup=False)
    return results


def _row(course: Course, trial: Trial) -> BenchResult:
    try:
        return _told(course.run(trial))
    except (CutShortError, DisturbedError) as error:
        why = "disturbed" if isinstance(error, DisturbedError) else "wrong"
        return BenchResult(
            name=trial.name, value=0.0, unit="ms", goal="undisturbed", ok=False, details={why: str(error)}
        )


def _told(outcome: Outcome) -> BenchResult:
    """Return the row of one fault: its value is how soon it was told, 0 where it was borne."""
    failures = outcome.failures()
    details = outcome.details()
    if failures:
        details["wrong"] = "; ".join(failures)
    goal = f"<= {1e3 * TOLD_S:g}, rest, stay" if outcome.trial.is_stop else "borne"
    value = 1e3 * (outcome.told_s or 0.0)
    return BenchResult(
        name=outcome.trial.name, value=round(value, 1), unit="ms", goal=goal, ok=not failures, details=details
    )
