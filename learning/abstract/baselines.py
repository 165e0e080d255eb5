"""The bench of presets without physics: what each learner's upper layers come to under the same drawn rules."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from statistics import fmean, median
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.progress import track

from config.loader import load_learning
from config.sources import shipped_names
from learning.abstract.learner import as_config_says, as_oracle
from learning.abstract.oracle import Told
from learning.abstract.protocol import Era, run_abstract
from learning.abstract.rules import draw_rules
from learning.abstract.table import Skills
from robot.bench import BenchReport, BenchResult, bench_report
from robot.parent import end_with_parent

__all__ = ["bench_baselines"]

FIRST_SEED = 400
"""Seeds from here on draw rules and runs; none of them chose a setting."""
FEW, MANY = 2, 20
N_GOALS, N_LITERALS, N_SWITCHES, ERA_EPOCHS = 6, 2, 2, 300
LEARN_GOAL, RECOVER_GOAL = 150, 100
ORACLE = "oracle"
"""Beside the presets: what could be had by who knows how rules are drawn."""


def bench_baselines(*, full: bool) -> BenchReport:
    """Learn rules drawn at random, with switches, by every shipped preset; full takes 20 seeds and not 2."""
    begin = perf_counter()
    seeds = range(FIRST_SEED, FIRST_SEED + (MANY if full else FEW))
    presets = (*_different_presets(), ORACLE)
    cells = [(name, seed) for name in presets for seed in seeds]
    with ProcessPoolExecutor(mp_context=get_context("spawn"), initializer=end_with_parent) as pool:
        ran = pool.map(_eras, *zip(*cells, strict=True))
        shown = track(ran, "presets", total=len(cells), console=Console(stderr=True), transient=True)
        eras = dict(zip(cells, shown, strict=True))
    results = [row for name in presets for row in _rows(name, [eras[name, seed] for seed in seeds])]
    return bench_report("baselines", tuple(results), seconds=perf_counter() - begin)


def _different_presets() -> Iterator[str]:
    """Yield the presets whose upper layers differ, the first of those that have the same; default comes first."""
    known: list[tuple[object, object]] = []
    for name in sorted(shipped_names("learning"), key=lambda name: (name != "default", name)):
        config = load_learning(name)
        layers = config.goal_selection, config.subgoal_selection
        if layers not in known:
            known.append(layers)
            yield name


def _eras(name: str, seed: int) -> tuple[Era, ...]:
    """Run one learner under rules that its seed alone draws: all learn the same."""
    told = Told(n_goals=N_GOALS, max_literals=N_LITERALS, hazard=1.0 / ERA_EPOCHS, skills=Skills())
    learner = as_oracle(told) if name == ORACLE else as_config_says(load_learning(name))
    rng = np.random.default_rng([seed, N_GOALS])
    draw = partial(draw_rules, rng, N_GOALS, max_literals=N_LITERALS)
    eras = tuple(draw() for _ in range(1 + N_SWITCHES))
    return run_abstract(seed=seed, learner=learner, eras=eras, epochs=ERA_EPOCHS).eras


def _rows(name: str, runs: list[tuple[Era, ...]]) -> tuple[BenchResult, ...]:
    firsts, laters = [eras[0] for eras in runs], [era for eras in runs for era in eras[1:]]
    success = fmean(era.success for eras in runs for era in eras)
    return (
        *_mastered(f"{name}_learnt", firsts, LEARN_GOAL),
        *_mastered(f"{name}_recovered", laters, RECOVER_GOAL),
        BenchResult(name=f"{name}_success", value=success, unit="share"),
    )


def _mastered(name: str, eras: list[Era], most: int) -> tuple[BenchResult, ...]:
    """Tell in which share of spans all goals were mastered soon enough, and after how many epochs in the middle."""
    reached = [era.mastered for era in eras if era.mastered is not None]
    share = sum(epochs <= most for epochs in reached) / len(eras)
    return (
        BenchResult(name=f"{name}_in_{most}", value=share, unit="share"),
        BenchResult(name=f"{name}_after", value=float(median(reached)) if reached else float("nan"), unit="epochs"),
    )
