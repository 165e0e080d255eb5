"""`autotelic teleop check --mutate`: each limit weakened alone, on all processors, kept as it comes. An edge."""

from functools import partial
from pathlib import Path
from time import perf_counter

import msgspec
from rich.console import Console
from rich.progress import Progress

from config.resolved import Resolved
from robot.bench import BenchResult, bench_report
from robot.teleop.wanted import Answer, Wanted
from sim_twin.checking.check import Setup, setup_of
from sim_twin.checking.kept import KeptOutcomes
from sim_twin.checking.mutations import Outcome, try_mutation
from sim_twin.checking.report import MutationReport, shown_mutations
from sim_twin.checking.spread import n_processors, spread
from sim_twin.checking.weakenings import MUTATIONS

__all__ = ["run_mutation", "weaken_each"]


def run_mutation(coded: bytes, name: str) -> Outcome:
    """Weaken one limit, by its name, in this process."""
    setup = msgspec.json.decode(coded, type=Setup)
    mutation = next(m for m in MUTATIONS if m.name == name)
    return try_mutation(setup.resolved, mutation, seed=setup.seed, n_commands=setup.n_commands)


def weaken_each(resolved: Resolved, wanted: Wanted) -> Answer:
    """Weaken each limit alone and see that the battery tells."""
    begin, setup = perf_counter(), setup_of(resolved, wanted)
    outcomes = _outcomes(setup, wanted)
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
    coded = msgspec.json.encode(report).decode()
    if wanted.out is not None:
        _keep(coded, wanted.out)
    return Answer(json=coded, shown=shown_mutations(report), is_passed=n_caught == len(outcomes))


def _outcomes(setup: Setup, wanted: Wanted) -> tuple[Outcome, ...]:
    """Return what came of each limit, in their order; those that were kept are not tried again."""
    kept = KeptOutcomes(wanted.out, setup)
    left = [m.name for m in MUTATIONS if m.name not in kept.by_limit]
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("limits weakened", total=len(MUTATIONS), completed=len(MUTATIONS) - len(left))

        def heard(outcome: Outcome) -> None:
            kept.add(outcome)
            progress.update(task, advance=1)

        work = partial(run_mutation, msgspec.json.encode(setup))
        spread(work, left, n_workers=wanted.n_workers or n_processors(), heard=heard)
    return tuple(kept.by_limit[m.name] for m in MUTATIONS)


def _keep(coded: str, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "weakened.json").write_text(coded + "\n", encoding="utf-8")
