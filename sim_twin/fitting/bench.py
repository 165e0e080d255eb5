"""`autotelic bench fit`: arms that differ from their files in known ways, and how often a fit finds it so."""

from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import msgspec
import numpy as np

from robot.bench import BenchReport, BenchResult, bench_report
from sim_twin.fitting.fit import Fit, fit_sessions
from sim_twin.fitting.trial import differing, record_trial

__all__ = ["bench_fit"]

N_QUICK, N_FULL, FIRST_SEED = 3, 100, 8000
SECONDS = 4.0
COVERED, MOST_RAD = 0.9, 3e-3


class _Trial(msgspec.Struct, frozen=True, kw_only=True):
    """What one fit came to."""

    fit: Fit
    inside: dict[str, bool]
    """Of each value that is told, whether the true one is in its interval."""
    seconds: float


def bench_fit(*, full: bool) -> BenchReport:
    """Fit sessions of the virtual controller's arm with lag, delay, gains, friction, payload and lengths injected."""
    begun_s = perf_counter()
    trials = [_trial(seed) for seed in range(FIRST_SEED, FIRST_SEED + (N_FULL if full else N_QUICK))]
    return bench_report("fit", _results(trials), seconds=perf_counter() - begun_s)


def _trial(seed: int) -> _Trial:
    by = differing(np.random.default_rng([seed, 1]))
    begun_s = perf_counter()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "trial.mcap"
        truth = record_trial(path, by, seed=seed, seconds=SECONDS)
        fit, _, _, _ = fit_sessions([path])
    inside = {
        row.name: abs(row.value - truth[row.name]) <= row.half
        for row in (*fit.rows, *fit.lengths)
        if row.half is not None
    }
    return _Trial(fit=fit, inside=inside, seconds=perf_counter() - begun_s)


def _results(trials: list[_Trial]) -> list[BenchResult]:
    told, right = Counter[str](), Counter[str]()
    for trial in trials:
        told.update(trial.inside.keys())
        right.update(name for name, is_inside in trial.inside.items() if is_inside)
    rows, n = trials[0].fit.rows, len(trials)
    # A value that a fit does not tell was not found; offsets along parallel axes are told in their sum alone.
    always = {row.name for row in rows}
    shares = {name: right[name] / (n if name in always else of) for name, of in told.items()}
    kinds = {kind: [s for name, s in shares.items() if name.split()[0] == kind] for kind in _kinds(trials[0].fit)}
    results = [
        BenchResult(
            name=f"inside_95_{kind}", value=round(min(found), 3), unit="share of fits, least of its joints",
            goal=f">= {COVERED}", ok=min(found) >= COVERED,
        )
        for kind, found in kinds.items() if found
    ]  # fmt: skip
    worst = sorted(max(trial.fit.after.worst_rad) for trial in trials)
    before = sorted(max(trial.fit.before.worst_rad) for trial in trials)
    told_share = min(told[row.name] for row in rows) / n
    untold = {name: str(n - told[name]) for name in (row.name for row in trials[0].fit.lengths) if told[name] < n}
    return [
        BenchResult(name="fits", value=float(n), unit="fits"),
        *results,
        BenchResult(name="told_share", value=round(told_share, 3), unit="share of fits, least of all values", goal=""),
        BenchResult(
            name="lengths_told", value=float(sum(told[row.name] == n for row in trials[0].fit.lengths)),
            unit=f"of {len(trials[0].fit.lengths)}", details=untold,
        ),
        BenchResult(
            name="held_out_worst_mrad", value=round(1e3 * worst[-1], 3), unit="mrad", goal=f"<= {1e3 * MOST_RAD:g}",
            ok=worst[-1] <= MOST_RAD,
        ),
        BenchResult(name="held_out_worst_mrad_before", value=round(1e3 * before[-1], 3), unit="mrad"),
        BenchResult(
            name="tool_off_mm", value=round(1e3 * max(t.fit.tool_after_m for t in trials), 6), unit="mm",
            details={"before": f"{1e3 * max(t.fit.tool_before_m for t in trials):.3f} mm"},
        ),
        BenchResult(name="seconds_a_fit", value=round(float(np.median([t.seconds for t in trials])), 2), unit="s"),
    ]  # fmt: skip


def _kinds(fit: Fit) -> list[str]:
    """Return what values begin with, once each."""
    return list(dict.fromkeys(row.name.split()[0] for row in (*fit.rows, *fit.lengths)))
