"""The bench of rules that no conjunction says, and of a table that fails now and then.

Each table has goals of one kind of `learning/abstract/outside.py`, or rules of the class on a table of which every
tenth press that should do something does nothing. Certainty is looked at where goals can be tried: a belief of 0.95 and
more in what is not so.
"""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from statistics import fmean, median
from time import perf_counter

import msgspec
import numpy as np
from rich.console import Console
from rich.progress import track

from config.loader import load_learning
from learning.abstract.learner import AbstractLearner, as_config_says
from learning.abstract.outside import KINDS, draw_outside, orders
from learning.abstract.protocol import Evaluations, foretelling
from learning.abstract.rules import TRIALS, Rule, draw_rules, permits
from learning.abstract.table import AbstractTable, Skills
from robot.bench import BenchReport, BenchResult, bench_report
from robot.parent import end_with_parent

__all__ = ["bench_outside"]

FIRST_SEED = 500
"""Seeds from here on draw rules and runs; none of them chose a setting."""
FEW, MANY = 2, 20
N_GOALS, ERA_EPOCHS, N_ERAS = 5, 200, 2
LEARNER, OTHERS = "default", ("hindsight", "drop", "mdp")
UNRELIABLE = "unreliable"
WORKING = 0.9
CERTAIN = 0.95
MOST_TIMES = 2.0
"""That the learner may take of what the best of the others takes."""
SKILLS = Skills()


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What one learner came to under one set of rules."""

    mastered: int | None
    """Epochs until every goal was, twice running; None where that never was."""
    certainly_wrong: float | None
    """Share of goals and goal-states that can come about in which it was certain of what is not so, at the end."""


def bench_outside(*, full: bool) -> BenchReport:
    """Learn rules outside what `default` can believe, before and after a switch; full takes 20 seeds and not 2."""
    begin = perf_counter()
    seeds = range(FIRST_SEED, FIRST_SEED + (MANY if full else FEW))
    cells = [(kind, name, seed) for kind in (*KINDS, UNRELIABLE) for name in (LEARNER, *OTHERS) for seed in seeds]
    with ProcessPoolExecutor(mp_context=get_context("spawn"), initializer=end_with_parent) as pool:
        ran = pool.map(_outcomes, *zip(*cells, strict=True))
        shown = track(ran, "outside the class", total=len(cells), console=Console(stderr=True), transient=True)
        told = dict(zip(cells, shown, strict=True))
    results = [
        row
        for kind in (*KINDS, UNRELIABLE)
        for row in _rows(kind, {n: [o for seed in seeds for o in told[kind, n, seed]] for n in (LEARNER, *OTHERS)})
    ]
    return bench_report("outside", results, seconds=perf_counter() - begin)


def _outcomes(kind: str, name: str, seed: int) -> tuple[Outcome, ...]:
    """Run one learner under rules that the seed alone draws: all learn the same."""
    drawing, first, second = np.random.default_rng([seed, N_GOALS]).spawn(3)
    table = AbstractTable(n_goals=N_GOALS, skills=_skills(kind), rng=first)
    learner = as_config_says(load_learning(name))(N_GOALS, second)
    return tuple(_outcome(table, learner, _drawn(drawing, kind), i * ERA_EPOCHS) for i in range(N_ERAS))


def _skills(kind: str) -> Skills:
    """Return skills; on the table that fails, what failed at the place looks blocked like anything else there."""
    if kind != UNRELIABLE:
        return SKILLS
    does = SKILLS.last * WORKING
    blocked = SKILLS.last * (1.0 - WORKING) + (1.0 - SKILLS.last) * SKILLS.wrongly_blocked
    return Skills(first=does, last=does, wrongly_blocked=blocked / (1.0 - does))


def _drawn(rng: np.random.Generator, kind: str) -> tuple[Rule, ...]:
    return draw_rules(rng, N_GOALS, max_literals=2) if kind == UNRELIABLE else draw_outside(rng, kind, N_GOALS)


def _outcome(table: AbstractTable, learner: AbstractLearner, rules: tuple[Rule, ...], n_before: int) -> Outcome:
    table.rules = rules
    evaluations = Evaluations(range(N_GOALS))
    for i in range(1, ERA_EPOCHS + 1):
        learner.learn_epoch(table, n_before + i)
        evaluations.look(i, table, learner, n_before + i)
    return Outcome(mastered=evaluations.mastered, certainly_wrong=_certainly_wrong(learner, rules))


def _certainly_wrong(learner: AbstractLearner, rules: Sequence[Rule]) -> float | None:
    chance = foretelling(learner.selector)
    if chance is None:
        return None
    wrong = [
        (1.0 - said if permits(rules[g], order) else said) >= CERTAIN
        for order in orders(rules, n_most=TRIALS)
        for g in range(len(rules))
        if g not in order
        for said in (chance(g, sum(1 << i for i in order)),)
    ]
    return fmean(wrong)


def _rows(kind: str, told: dict[str, list[Outcome]]) -> list[BenchResult]:
    """Return how many epochs each took to master all goals, and how certainly the learner was wrong."""
    taken = {name: median([o.mastered or np.inf for o in outcomes]) for name, outcomes in told.items()}
    best = min(taken[name] for name in OTHERS)
    rows = [
        BenchResult(
            name=f"{kind}_{name}_after", value=float(taken[name]), unit="epochs",
            goal=f"<= {MOST_TIMES:g} x the best other" if name == LEARNER else "",
            ok=name != LEARNER or taken[name] <= MOST_TIMES * best,
            details={"mastered": f"{sum(o.mastered is not None for o in outcomes)} of {len(outcomes)}"},
        )
        for name, outcomes in told.items()
    ]  # fmt: skip
    shares = [o.certainly_wrong for o in told[LEARNER] if o.certainly_wrong is not None]
    return [*rows, BenchResult(name=f"{kind}_certainly_wrong", value=fmean(shares), unit="share")]
