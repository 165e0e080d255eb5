"""What `autotelic teleop check` does on a twin: progress, report, figure. The command itself knows no twin."""

from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import msgspec
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from config.resolved import Resolved
from robot.bench import bench_report
from robot.teleop.wanted import Answer, Wanted
from sim_twin.checking.check import Setup, check_streams, part_of, rerun, setup_of
from sim_twin.checking.kept import KeptStreams
from sim_twin.checking.report import CheckReport, as_json, draw, shown
from sim_twin.checking.ring import StreamResult
from sim_twin.checking.spread import n_processors
from sim_twin.checking.tally import Tally
from sim_twin.checking.weakened import weaken_each

__all__ = ["check_rig", "keep", "measured"]


def check_rig(resolved: Resolved, wanted: Wanted) -> Answer:
    """Check a twin's rig and return what is to be shown of it."""
    if wanted.mutate:
        return weaken_each(resolved, wanted)
    setup = setup_of(resolved, wanted)
    report = measured(setup, wanted)
    if wanted.out is not None:
        keep(setup, report, wanted.out)
    return Answer(json=as_json(report), shown=shown(report), is_passed=report.is_passed)


def measured(setup: Setup, wanted: Wanted, *, look: Callable[[], object] = lambda: None) -> CheckReport:
    """Run the streams that are wanted, and return the report; what `look` raises meanwhile ends the check."""
    begin = perf_counter()
    tally = _one(setup, wanted.stream) if wanted.stream is not None else _many(setup, wanted, look)
    return _report(setup, tally, wanted, seconds=perf_counter() - begin)


def _one(setup: Setup, number: int) -> Tally:
    tally = Tally()
    came, _ = rerun(setup, number)
    tally.add(came)
    return tally


def _many(setup: Setup, wanted: Wanted, look: Callable[[], object]) -> Tally:
    blocks = part_of(setup, full=wanted.full)
    if wanted.n_blocks:
        blocks = blocks[: wanted.n_blocks]
    tally, kept = Tally(), KeptStreams(wanted.out, setup)
    n_workers = wanted.n_workers or n_processors()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("streams", total=sum(b.n_streams for b in blocks))

        def told(results: list[StreamResult]) -> None:
            for came in results:
                tally.add(came)
            progress.update(task, advance=len(results), description=f"streams, {tally.n_violations} violations")

        def heard(results: list[StreamResult]) -> None:
            kept.add(results)
            told(results)

        before = [(block, kept.of(block)) for block in blocks]
        for _, results in before:
            told(results or [])
        left = tuple(block for block, results in before if results is None)
        check_streams(setup, left, n_workers=n_workers, heard=heard, look=look)
    return tally


def _report(setup: Setup, tally: Tally, wanted: Wanted, *, seconds: float) -> CheckReport:
    bench = bench_report("safety", tally.results(), seconds=seconds)
    return CheckReport(
        **msgspec.structs.asdict(bench), rig=setup.resolved.rig.name, profile=setup.profile.name, seed=setup.seed,
        full=wanted.full, streams_by_plant=tally.streams_by_plant, limits=tally.rows, breaches=tally.breaches,
    )  # fmt: skip


def keep(setup: Setup, report: CheckReport, folder: Path, *, about: str = "") -> None:
    """Keep a report and its figure in a folder, the figure headed by what it is about."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "check.json").write_text(as_json(report) + "\n", encoding="utf-8")
    draw(setup, report, folder / "margins.png", about=about)
