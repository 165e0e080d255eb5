"""What `autotelic teleop check` does on a twin: progress, report, figure. The command itself knows no twin."""

import os
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import msgspec
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from config.resolved import Resolved
from robot.bench import BenchResult, bench_report
from robot.teleop.wanted import Answer, Wanted
from sim_twin.as_seen import Beginning
from sim_twin.checking.check import N_COMMANDS, Setup, check_streams, part_of, rerun
from sim_twin.checking.kept import KeptStreams
from sim_twin.checking.mutations import try_mutation
from sim_twin.checking.report import CheckReport, MutationReport, as_json, draw, shown, shown_mutations
from sim_twin.checking.ring import StreamResult
from sim_twin.checking.tally import Tally
from sim_twin.checking.weakenings import MUTATIONS

__all__ = ["check_rig", "keep", "measured", "setup_of"]


def check_rig(resolved: Resolved, wanted: Wanted) -> Answer:
    """Check a twin's rig and return what is to be shown of it."""
    if wanted.mutate:
        return _mutate(resolved, wanted)
    setup = setup_of(resolved, wanted)
    report = measured(setup, wanted)
    if wanted.out is not None:
        keep(setup, report, wanted.out)
    return Answer(json=as_json(report), shown=shown(report), is_passed=report.is_passed)


def setup_of(resolved: Resolved, wanted: Wanted, *, start: Beginning | None = None) -> Setup:
    """Return what is checked, by the options; `start` is where arm and table are at each stream's beginning."""
    return Setup(
        resolved=resolved,
        profile=resolved.profile,
        seed=wanted.seed,
        n_commands=wanted.n_commands or N_COMMANDS,
        start=start,
    )


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
    n_workers = wanted.n_workers or len(os.sched_getaffinity(0))
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


def _mutate(resolved: Resolved, wanted: Wanted) -> Answer:
    """Weaken each limit alone and see that the battery tells."""
    begin = perf_counter()
    n_commands = wanted.n_commands or N_COMMANDS
    with Progress(console=Console(stderr=True), transient=True) as progress:
        outcomes = tuple(
            try_mutation(resolved, mutation, seed=wanted.seed, n_commands=n_commands)
            for mutation in progress.track(MUTATIONS, description="limits weakened")
        )
    n_caught = sum(outcome.is_caught for outcome in outcomes)
    rows = (
        BenchResult(name="limits_weakened", value=len(outcomes), unit="1"),
        BenchResult(name="caught", value=n_caught, unit="1", goal=f"{len(outcomes)}", ok=n_caught == len(outcomes)),
    )
    bench = bench_report("safety_mutations", rows, seconds=perf_counter() - begin)
    report = MutationReport(
        **msgspec.structs.asdict(bench), rig=resolved.rig.name, profile=resolved.profile.name, seed=wanted.seed,
        outcomes=outcomes,
    )  # fmt: skip
    return Answer(
        json=msgspec.json.encode(report).decode(), shown=shown_mutations(report), is_passed=n_caught == len(outcomes)
    )
