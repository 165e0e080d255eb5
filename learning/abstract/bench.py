"""The bench of the upper layers without physics: drawn rules, switches, many goals, and what a decision takes."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from statistics import median
from time import perf_counter

import numpy as np
from msgspec.structs import replace
from rich.console import Console
from rich.progress import track

from config.learning import LearningConfig
from config.loader import load_learning
from learning.abstract.added import Added, run_added
from learning.abstract.learner import AbstractLearner, MakeAbstract, as_config_says, as_oracle
from learning.abstract.oracle import Told
from learning.abstract.protocol import Era, run_abstract
from learning.abstract.rules import Rules, draw_more_rules, draw_rules
from learning.abstract.table import AbstractTable, Skills
from robot.bench import BenchReport, BenchResult, bench_report

__all__ = ["bench_abstract"]

FIRST_SEED = 300
"""Seeds from here on draw rules and runs; none of them chose a setting."""
FEW, MANY = 2, 20
N_GOALS, N_MANY_GOALS = 6, 12
N_LITERALS = 2
N_SWITCHES = 5
ERA_EPOCHS = 300
LEARN_GOAL, RECOVER_GOAL, RIGHT_GOAL = 150, 100, 60
ENOUGH_SHARE, ENOUGH_MANY = 19 / 20, 18 / 20
N_EPOCHS, EPOCHS_GOAL_S = 2000, 5.0
ADDED_AT, ADDED_FOR, OLD_GOALS_LEAST = 150, 150, 0.9
STEADY_EPOCHS, SETTLED_EPOCHS, STEADY_SKILL = 1000, 200, 0.9
DECISION_GOALS, DECISION_EPOCHS, DECISION_GOAL_MS = (6, 12, 24), 40, 5.0


def bench_abstract(*, full: bool) -> BenchReport:
    """Learn drawn rules by the default preset and by the oracle; full takes 20 seeds of each row and not 2."""
    begin = perf_counter()
    config = load_learning("default")
    seeds = range(FIRST_SEED, FIRST_SEED + (MANY if full else FEW))
    results = (
        *_beside_the_oracle(_switch_rows, config, seeds, n_goals=N_GOALS),
        *_beside_the_oracle(_many_goals_rows, config, seeds, n_goals=N_MANY_GOALS),
        *_added_rows(as_config_says(config), seeds),
        _steady_row(config),
        _speed_row(config),
        *(_decision_row(config, n_goals) for n_goals in DECISION_GOALS),
    )
    return bench_report("abstract", results, seconds=perf_counter() - begin)


def _drawn(seed: int, n_goals: int, n_eras: int) -> tuple[Rules, ...]:
    rng = np.random.default_rng([seed, n_goals])
    return tuple(draw_rules(rng, n_goals, max_literals=N_LITERALS) for _ in range(n_eras))


def _beside_the_oracle(
    rows: Callable[[MakeAbstract, Sequence[int]], tuple[BenchResult, ...]],
    config: LearningConfig,
    seeds: Sequence[int],
    *,
    n_goals: int,
) -> Iterator[BenchResult]:
    """Yield the learner's rows, each before the oracle's, of which nothing is asked."""
    told = Told(n_goals=n_goals, max_literals=N_LITERALS, hazard=1.0 / ERA_EPOCHS, skills=Skills())
    for row, best in zip(rows(as_config_says(config), seeds), rows(as_oracle(told), seeds), strict=True):
        yield row
        yield replace(best, name=f"oracle_{best.name}", goal="", ok=True)


def _run(learner: MakeAbstract, seed: int, n_goals: int, n_eras: int) -> tuple[Era, ...]:
    return run_abstract(seed=seed, learner=learner, eras=_drawn(seed, n_goals, n_eras), epochs=ERA_EPOCHS).eras


def _switch_rows(learner: MakeAbstract, seeds: Sequence[int]) -> tuple[BenchResult, ...]:
    runs = [_run(learner, seed, N_GOALS, 1 + N_SWITCHES) for seed in _shown(seeds, "six goals, five switches")]
    laters = [eras[1:] for eras in runs]
    return (
        _share("learnt_share", [_is_within(eras[0].mastered, LEARN_GOAL) for eras in runs], ENOUGH_SHARE),
        _share(
            "recovered_share",
            [all(_is_within(era.mastered, RECOVER_GOAL) for era in eras) for eras in laters], ENOUGH_SHARE,
        ),
        _middle("learnt_after", [eras[0].mastered for eras in runs]),
        _middle("recovered_after", [era.mastered for eras in laters for era in eras]),
        _share("graph_right_share", [_is_within(era.right, RIGHT_GOAL) for eras in runs for era in eras]),
        _worst("over_optimum_worst", [era.over_optimum for eras in runs for era in eras]),
        BenchResult(
            name="least_success", value=min(era.least_success for eras in runs for era in eras), unit="share",
        ),
    )  # fmt: skip


def _many_goals_rows(learner: MakeAbstract, seeds: Sequence[int]) -> tuple[BenchResult, ...]:
    eras = [_run(learner, seed, N_MANY_GOALS, 1)[0] for seed in _shown(seeds, "twelve goals")]
    return (
        _share("twelve_goals_mastered_share", [_is_within(era.mastered, ERA_EPOCHS) for era in eras], ENOUGH_MANY),
        _middle("twelve_goals_mastered_after", [era.mastered for era in eras]),
    )


def _added_rows(learner: MakeAbstract, seeds: Sequence[int]) -> tuple[BenchResult, ...]:
    """Tell what becomes of a goal that is added when six were learnt, and of those six."""
    runs: list[Added] = []
    for seed in _shown(seeds, "a seventh goal"):
        rng = np.random.default_rng([seed, N_GOALS])
        known = draw_rules(rng, N_GOALS, max_literals=N_LITERALS)
        rules = draw_more_rules(rng, known, N_GOALS + 1, max_literals=N_LITERALS)
        runs.append(run_added(seed=seed, learner=learner, rules=rules, n_known=N_GOALS, at=ADDED_AT, epochs=ADDED_FOR))
    old = min(run.old_least_success for run in runs)
    return (
        _middle("added_goal_mastered_after", [run.mastered_after for run in runs]),
        BenchResult(
            name="added_goal_old_goals_least", value=old, unit="share", goal=f">= {OLD_GOALS_LEAST:g}",
            ok=old >= OLD_GOALS_LEAST, details={"of": "test epochs of one old goal at one evaluation since"},
        ),
    )  # fmt: skip


def _steady_row(config: LearningConfig) -> BenchResult:
    """Count revisions of what goals need, the rules standing still, after they were learnt."""
    (rules,) = _drawn(FIRST_SEED, N_GOALS, 1)
    skills = Skills(first=STEADY_SKILL, last=STEADY_SKILL)
    table, learner = _made(config, rules, skills)
    n_alarms = 0
    for epoch in range(SETTLED_EPOCHS + STEADY_EPOCHS):
        before = [belief.most_probable for belief in learner.graph.beliefs]
        learner.learn_epoch(table, epoch)
        after = [belief.most_probable for belief in learner.graph.beliefs]
        n_alarms += epoch >= SETTLED_EPOCHS and before != after
    return BenchResult(
        name="false_alarms", value=float(n_alarms), unit="epochs", goal="= 0", ok=n_alarms == 0,
        details={"in": f"{STEADY_EPOCHS} epochs under rules that stand still, skill {STEADY_SKILL:g}"},
    )  # fmt: skip


def _speed_row(config: LearningConfig) -> BenchResult:
    (rules,) = _drawn(FIRST_SEED, N_GOALS, 1)
    table, learner = _made(config, rules, Skills())
    begin = perf_counter()
    for epoch in range(N_EPOCHS):
        learner.learn_epoch(table, epoch)
    spent_s = perf_counter() - begin
    return BenchResult(
        name="epochs_2000_s", value=spent_s, unit="s", goal=f"<= {EPOCHS_GOAL_S:g}", ok=spent_s <= EPOCHS_GOAL_S
    )


def _decision_row(config: LearningConfig, n_goals: int) -> BenchResult:
    """Time decisions while learning, all that is done for one included."""
    (rules,) = _drawn(FIRST_SEED, n_goals, 1)
    table, learner = _made(config, rules, Skills())
    times_ms: list[float] = []
    for epoch in range(DECISION_EPOCHS):
        begin = perf_counter()
        _, _, n_trials = learner.learn_epoch(table, epoch)
        times_ms.append(1e3 * (perf_counter() - begin) / n_trials)
    value, is_asked = median(times_ms), n_goals == max(DECISION_GOALS)
    return BenchResult(
        name=f"decision_{n_goals}_goals_ms", value=value, unit="ms",
        goal=f"<= {DECISION_GOAL_MS:g}" if is_asked else "", ok=not is_asked or value <= DECISION_GOAL_MS,
    )  # fmt: skip


def _made(config: LearningConfig, rules: Rules, skills: Skills) -> tuple[AbstractTable, AbstractLearner]:
    first, second = np.random.default_rng(FIRST_SEED).spawn(2)
    table = AbstractTable(n_goals=len(rules), skills=skills, rng=first)
    table.rules = rules
    return table, as_config_says(config)(len(rules), second)


def _shown(seeds: Sequence[int], what: str) -> Iterable[int]:
    return track(seeds, what, console=Console(stderr=True), transient=True)


def _is_within(epochs: int | None, most: int) -> bool:
    return epochs is not None and epochs <= most


def _share(name: str, are: Sequence[bool], least: float | None = None) -> BenchResult:
    share = sum(are) / len(are)
    return BenchResult(
        name=name, value=share, unit="share", goal="" if least is None else f">= {least:g}",
        ok=least is None or share >= least, details={"runs": f"{sum(are)} of {len(are)}"},
    )  # fmt: skip


def _middle(name: str, values: Sequence[int | None]) -> BenchResult:
    reached = [value for value in values if value is not None]
    value = median(reached) if reached else float("nan")
    return BenchResult(
        name=name, value=float(value), unit="epochs", details={"reached": f"{len(reached)} of {len(values)}"}
    )


def _worst(name: str, values: Sequence[float]) -> BenchResult:
    return BenchResult(name=name, value=max(values), unit="trials")
