"""`autotelic bench processes`: what becomes of an arm under way when the processes that move it die, freeze or lie."""

from time import perf_counter

from robot.bench import BenchReport, BenchResult, bench_report
from sim_twin.broken.tries import CutShortError, DisturbedError
from sim_twin.processes.cases import CASES, Case
from sim_twin.processes.course import ProcessCourse
from sim_twin.processes.judge import RAMP_S

__all__ = ["bench_processes"]

HOST = "127.0.0.40"
GOAL = f"<= {1e3 * RAMP_S:g}, rest, stay, latched"


def bench_processes(*, full: bool) -> BenchReport:
    """Put the processes that move an arm under way through each case, judged on the twin's own joints.

    Args:
        full: all cases; otherwise a commander that is killed, frozen, slow or sends garbage, a servo process that is
            killed, and a bus that is cut.
    """
    begun = perf_counter()
    with ProcessCourse(HOST) as course:
        results = [_row(course, case) for case in CASES if full or case.is_brief]
    return bench_report("processes", results, seconds=perf_counter() - begun)


def _row(course: ProcessCourse, case: Case) -> BenchResult:
    """Return one case's row: its value is how long after the last good intent the ramp began."""
    try:
        outcome = course.run(case)
    except (CutShortError, DisturbedError) as error:
        why = "disturbed" if isinstance(error, DisturbedError) else "wrong"
        return BenchResult(
            name=case.name, value=0.0, unit="ms", goal="undisturbed", ok=False, details={why: str(error)}
        )
    failures, details = outcome.failures(), outcome.details()
    if failures:
        details["wrong"] = "; ".join(failures)
    value = round(min(1e3 * outcome.ramp.ramp_s, 1e6), 1)
    return BenchResult(name=case.name, value=value, unit="ms", goal=GOAL, ok=not failures, details=details)
