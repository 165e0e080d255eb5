"""`autotelic bench wire`: the same intents on the twin and over the wire, and what a run's learner achieves there."""

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from time import perf_counter

from robot.bench import BenchReport, BenchResult, bench_report
from robot.rigs import load
from sim_twin.paired.errands import Kind
from sim_twin.paired.ride import Compared, CutShortError, DisturbedError, Pair

__all__ = ["bench_wire", "path_results"]

HOST = "127.0.0.34"
FRECHET_GOAL_MM = 3.0
N_ERRANDS, N_ALL = 6, 30
FIRST_SEED = 200
"""Errands of seeds below 60 were looked into while what bent their paths was found."""
BUDGET_S, BUDGET_ALL_S = 45.0, 600.0
"""No further errand is begun after so long: a machine that is busy elsewhere disturbs many."""
N_TESTS, N_ALL_TESTS = 1, 20
SUCCESS_ROWS = "learning.wired:success_rows"
"""The learner's part, by name: neither room knows the other."""


def bench_wire(*, full: bool, run: Path | None = None) -> BenchReport:
    """Compare the tool's paths in lock-step and through servo process, genuine client and virtual controller.

    Args:
        full: 30 errands rather than 6, and 20 test epochs a goal rather than 1.
        run: a run's folder; what it has learnt is tested over the wire too, under the rules that it learnt with last.
    """
    begun = perf_counter()
    with Pair(HOST) as pair:
        results: list[BenchResult] = []
        if run is not None:
            success_rows = load(SUCCESS_ROWS)
            results += success_rows(run, rig=pair.write_rig(), n_tests=N_ALL_TESTS if full else N_TESTS)
        results += _measure_paths(pair, N_ALL if full else N_ERRANDS, BUDGET_ALL_S if full else BUDGET_S)
    return bench_report("wire", results, seconds=perf_counter() - begun)


def _measure_paths(pair: Pair, n_errands: int, budget_s: float) -> list[BenchResult]:
    begun = perf_counter()
    compared: list[Compared] = []
    n_cut_short, kinds = 0, tuple(Kind)
    for seed in range(FIRST_SEED, FIRST_SEED + n_errands):
        if perf_counter() - begun > budget_s:
            break
        try:
            compared.append(pair.run(kinds[seed % len(kinds)], seed=seed))
        except DisturbedError:
            continue
        except CutShortError:
            n_cut_short += 1
    return path_results(compared, n_errands=n_errands, n_sent=pair.n_sent, n_cut_short=n_cut_short)


def path_results(
    compared: Sequence[Compared], *, n_errands: int, n_sent: int, n_cut_short: int = 0
) -> list[BenchResult]:
    """Return the rows.

    Args:
        compared: errands that came to their end in time.
        n_errands: how many were wanted; what this machine disturbed each time is left out.
        n_sent: how often one was sent, disturbed tries too.
        n_cut_short: how many came to no end on a machine that was not busy.
    """
    n_least = (n_errands + 1) // 2
    rows = [
        BenchResult(name="errands_compared", value=float(len(compared)), unit=f"of {n_errands}", goal=f">= {n_least}",
                    ok=len(compared) >= n_least),
        BenchResult(name="errands_cut_short", value=float(n_cut_short), unit="", goal="= 0", ok=n_cut_short == 0),
        BenchResult(name="tries_disturbed", value=float(n_sent - len(compared)), unit=f"of {n_sent}"),
    ]  # fmt: skip
    if not compared:
        return rows
    worst = max(compared, key=lambda one: one.distance.frechet_m)
    frechet_mm = [1e3 * one.distance.frechet_m for one in compared]
    by_kind = {
        kind.value: f"{max(found):.2f}"
        for kind in Kind
        if (found := [1e3 * one.distance.frechet_m for one in compared if one.errand.kind is kind])
    }
    offsets_ms = [1e3 * one.distance.offset_s for one in compared]
    return [
        BenchResult(name="frechet_mm_p50", value=median(frechet_mm), unit="mm"),
        BenchResult(
            name="frechet_mm_max", value=max(frechet_mm), unit="mm", goal=f"<= {FRECHET_GOAL_MM:g}",
            ok=max(frechet_mm) <= FRECHET_GOAL_MM,
            details={**by_kind, "worst": f"{worst.errand.kind} of seed {worst.errand.seed}"},
        ),
        BenchResult(
            name="offset_ms_p50", value=median(offsets_ms), unit="ms",
            details={"least": f"{min(offsets_ms):.0f}", "most": f"{max(offsets_ms):.0f}"},
        ),
        BenchResult(
            name="same_time_mm_p50", value=median(1e3 * one.distance.mean_m for one in compared), unit="mm",
            details={"what": "mean distance at the same time, the offset taken off"},
        ),
        BenchResult(name="start_mm_max", value=max(1e3 * one.start_m for one in compared), unit="mm"),
        *rows,
    ]  # fmt: skip
