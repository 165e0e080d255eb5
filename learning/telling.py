"""Figures of merit in words and tables, for a terminal. Pure."""

from collections.abc import Iterator, Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from learning.explain import Explanation
from learning.metrics import AddedGoal, EraSummary
from learning.progress import duration_text
from learning.report import Count, Report, Run, Spread
from learning.rows import EvaluationRow
from learning.run_folder import GoalInfo
from learning.statistics import Interval
from learning.time_spent import TimeSpent

__all__ = [
    "explanation_table",
    "not_known_yet",
    "profile_table",
    "report_table",
    "report_tables",
    "score_table",
    "summary_lines",
]


def summary_lines(run: Run) -> Iterator[str]:
    """Yield what a run came to, a line a set of rules."""
    summary = run.summary
    yield (
        f"{run.folder}: {summary.n_epochs} epochs, {summary.n_trials} trials, {summary.n_time_steps} decisions"
        + (f", {summary.n_void_epochs} void epochs" if summary.n_void_epochs else "")
    )
    for i, era in enumerate(summary.eras):
        yield f"  {_era_line(era, is_first=i == 0)}"
    for added in summary.added:
        yield f"  {_added_line(added, run.manifest.goals[added.goal].name)}"
    if run.stops is not None:
        yield f"  {run.stops.line()}"


def _added_line(added: AddedGoal, name: str) -> str:
    after = "not mastered yet" if added.mastered_after is None else f"mastered after {added.mastered_after} epochs"
    others = (
        "" if added.others_least_success is None else f", others at least {added.others_least_success:.0%} meanwhile"
    )
    return f"{name}, known from epoch {added.from_epoch}: {after}{others}"


def _era_line(era: EraSummary, *, is_first: bool) -> str:
    word = "learnt" if is_first else f"rules changed at epoch {era.from_epoch}: recovered"
    after = "not yet" if era.learnt_after is None else f"after {era.learnt_after} epochs"
    graph = ""
    if era.graph_right_after is not None:
        graph = f", graph right after {era.graph_right_after}"
    elif era.graph_wrong_last is not None:
        n_wrong, n_cases = era.graph_wrong_last
        graph = f", graph never right ({n_wrong} of {n_cases} predictions wrong at last)"
    if era.graph_wrong_later:
        graph += f" (wrong again at {era.graph_wrong_later:.0%} of later looks)"
    shares = [share for share in era.success_by_goal if share is not None]
    success = f", least success at the end {min(shares):.0%}" if shares else ""
    excess = era.trials_over_optimum
    worst = era.trials_over_optimum_worst
    trials = "" if excess is None else f", {excess:.2f} trials over the optimum (goal with most: {worst:.2f})"
    return f"{word} {after}{graph}{success}{trials}"


def report_table(report: Report) -> Table:
    """Return a table of all groups and sets of rules: how many learnt over its 95 % interval, median over range.

    Of three runs and more the interquartile mean follows, with its 95 % interval in brackets.

    Where not every run of a group has a figure, or came to a set of rules, the cell says how many did.
    """
    table = Table(
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        caption="trials over the optimum: mean over goals, and of the goal with most",
    )
    for heading in (
        "learner", "rules\nfrom", "learnt", "after\nepochs", "graph\nright", "over\noptimum", "worst\ngoal", "success"
    ):  # fmt: skip
        table.add_column(heading, overflow="fold")
    for group in report.groups:
        for era in group.eras:
            table.add_row(
                Text(group.name),
                f"{era.from_epoch}{_share_of_runs(era.n_runs, len(group.seeds))}",
                _count(era.learnt),
                _spread(era.learnt_after, "{:.0f}"),
                "–" if era.graph_right is None else _spread(era.graph_right_after, "{:.0f}"),
                _spread(era.trials_over_optimum, "{:.2f}"),
                _spread(era.trials_over_optimum_worst, "{:.2f}"),
                _spread(era.success, "{:.0%}"),
                end_section=True,
            )
    return table


def report_tables(report: Report) -> list[Table]:
    """Return the table of all groups and, where there are intervals, one of how they compare."""
    is_compared = any(c.success is not None or c.trials is not None for c in report.comparisons)
    return [report_table(report), *([_comparison_table(report)] if is_compared else [])]


def _comparison_table(report: Report) -> Table:
    """Return how surely each learner is better than each that came after it."""
    table = Table(
        "a run of", "against one of", "rules\nfrom", "has more success", "needs fewer trials", box=box.SIMPLE_HEAD,
        pad_edge=False, caption="probability with its 95 % interval; 50 %: as good",
    )  # fmt: skip
    for row in report.comparisons:
        cells = ("–" if x is None else _interval(x, "{:.0%}") for x in (row.success, row.trials))
        table.add_row(Text(row.ours), Text(row.theirs), str(row.from_epoch), *cells)
    return table


def score_table(rows: Sequence[EvaluationRow], goals: Sequence[str]) -> Table:
    """Return a table of one evaluation."""
    table = Table("goal", "achieved", "trials when achieved", "graph wrong in")
    for row in rows:
        trials = f"{row.trials_achieved / row.n_successes:.2f}" if row.n_successes else "–"
        graph = "–" if row.graph_cases is None else f"{row.graph_wrong} of {row.graph_cases} states"
        table.add_row(Text(goals[row.goal]), f"{row.n_successes} of {row.n_all}", trials, graph)
    return table


def not_known_yet(explanations: Sequence[Explanation], goals: Sequence[GoalInfo]) -> list[str]:
    """Return in words which goals the learner knows nothing of yet."""
    told = {explanation.goal for explanation in explanations}
    return [f"{g.name}: not known yet, from epoch {g.from_epoch}" for i, g in enumerate(goals) if i not in told]


def explanation_table(explanations: Sequence[Explanation], goals: Sequence[str]) -> Table:
    """Return a table of what is believed of each goal: narrow enough for 80 columns, and no name is cut."""
    table = Table(show_lines=True)
    for heading in ("goal", "needs, and the plan from a fresh table", "on what evidence"):
        table.add_column(heading, overflow="fold")
    for told in explanations:
        sure = {(literal.goal, literal.is_on): literal.probability for literal in told.literals}
        needs = [
            f"{'' if is_on else 'not '}{goals[i]} {sure.get((i, is_on), 0.0):.0%}"
            for is_on, members in ((True, told.needs_on), (False, told.needs_off))
            for i in members
        ]
        doubts = [
            f"{'' if literal.is_on else 'not '}{goals[literal.goal]} {literal.probability:.0%}"
            for literal in told.literals
            if literal.goal not in (*told.needs_on, *told.needs_off)
        ]
        table.add_row(
            Text(goals[told.goal]),
            Text("\n").join(
                [
                    *(Text(need) for need in needs or ["nothing"]),
                    *(Text(f"perhaps {doubt}", "dim") for doubt in doubts),
                    Text(_plan(told, goals)),
                ]
            ),
            "\n".join([f"{told.probability:.0%} sure of all", *_evidence(told), f"skill {told.skill:.0%}"]),
        )
    return table


def _evidence(told: Explanation) -> list[str]:
    """Return the attempts that speak for and against what is believed, those before it last changed apart."""
    counts = f"{told.n_for} for, {told.n_against} against"
    if told.changed_epoch is None:
        return [counts, "never changed"]
    before = f"[dim]before: {told.n_for_before} for, {told.n_against_before} against[/dim]"
    return [
        f"since epoch {told.changed_epoch}:",
        counts,
        *([before] if told.n_for_before + told.n_against_before else []),
    ]


def _plan(told: Explanation, goals: Sequence[str]) -> str:
    """Return the plan, a line an arrow, so that a narrow column breaks between names only."""
    return "\n → ".join(["plan", *(goals[i] for i in told.plan)]) if told.plan else "no plan known"


def profile_table(spent: TimeSpent) -> Table:
    """Return where a run's time went, greatest share first."""
    table = Table("layer", "seconds", "share", "µs a decision", title=f"{duration_text(spent.seconds)}, by layer")
    total = sum(spent.seconds_by_layer.values()) or 1.0
    for name, seconds in sorted(spent.seconds_by_layer.items(), key=lambda entry: -entry[1]):
        table.add_row(name, f"{seconds:.1f}", f"{seconds / total:.0%}", f"{spent.us_per_decision_by_layer[name]:.0f}")
    return table


def _count(count: Count) -> str:
    return f"{count.n}/{count.of}\n{100 * count.share_low:.0f}–{count.share_high:.0%}"


def _spread(spread: Spread, form: str) -> str:
    few = _share_of_runs(spread.n, spread.of)
    if spread.median is None or spread.least is None or spread.greatest is None:
        return f"–{few}"
    middle = form.format(spread.median)
    if spread.n == 1:
        return f"{middle}{few}"
    between = "" if spread.middle is None else f"\n{_interval(spread.middle, form)}"
    return f"{middle}\n{form.format(spread.least).removesuffix('%')}–{form.format(spread.greatest)}{few}{between}"


def _interval(interval: Interval, form: str) -> str:
    value, low, high = (form.format(x) for x in (interval.value, interval.low, interval.high))
    return f"{value} [{low.removesuffix('%')}, {high}]"


def _share_of_runs(n: int, of: int) -> str:
    return "" if n == of else f"\n{n} of {of}\nruns"
