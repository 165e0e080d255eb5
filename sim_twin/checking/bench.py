"""The safety bench: the check's seeded tenth on the shipped twin rig, as rows that can be followed over time."""

from config.loader import resolve
from robot.bench import BenchReport, bench_report
from robot.teleop.wanted import Wanted
from sim_twin.checking.check import setup_of
from sim_twin.checking.command import measured

__all__ = ["bench_safety"]


def bench_safety(*, full: bool) -> BenchReport:
    """Let hostile and human-like streams loose on the twin: all of them, or a tenth, some minutes."""
    wanted = Wanted(full=full)
    report = measured(setup_of(resolve(), wanted), wanted)
    return bench_report("safety", report.results, seconds=report.seconds)
