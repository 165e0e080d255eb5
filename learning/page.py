"""A report as one HTML file that stands alone: figures inside, nothing fetched, the same runs the same bytes. Pure."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape

import msgspec

from config.learning import LearningConfig
from learning.metrics import Summary
from learning.page_style import CSS
from learning.report import Count, EraReport, Group, Report, Spread
from learning.run_folder import Manifest
from learning.statistics import Interval, Reached

__all__ = ["Picture", "differences", "page"]

NOTHING = "–"


class Picture(msgspec.Struct, frozen=True, kw_only=True):
    """A figure of the page."""

    name: str
    """Of its files."""
    says: str
    """What it shows, for those who cannot see it too."""
    svg: str


def page(
    report: Report, groups: Sequence[Group], pictures: Sequence[Picture], learners: Mapping[str, LearningConfig]
) -> str:
    """Return the page.

    Args:
        report: figures of merit.
        groups: the runs that they are of.
        pictures: figures, in order.
        learners: what each group's learner is made of, as far as that is known.
    """
    title = ", ".join(group.name for group in groups)
    n_runs = sum(len(group.runs) for group in groups)
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>autotelic: {escape(title)}</title><style>{CSS}</style></head><body><main>",
            f"<h1>{n_runs} run{'' if n_runs == 1 else 's'}: {escape(title)}</h1>",
            "<h2>Learners</h2>",
            _learners(groups, learners),
            "<h2>What they came to</h2>",
            _figures_of_merit(report),
            _EXPLAINED,
            *([f"<h2>Who is surely better</h2>{_comparisons(report)}"] if _is_compared(report) else []),
            "<h2>Figures</h2>",
            *(_figure(picture) for picture in pictures),
            "<h2>Runs</h2>",
            _runs(groups),
            "</main></body></html>\n",
        ]
    )


_EXPLAINED = (
    "<p>A goal is mastered at an evaluation where 18 of 20 test epochs succeed, learning off. Learnt, and under later "
    "rules recovered, is the first of two evaluations running at which every goal is mastered. Shares have Wilson's "
    "95 % interval. Epochs are medians over all runs, in which one that never learnt counts as later than all; other "
    "figures are medians with their range, then the interquartile mean. Intervals in brackets are 95 % by bootstrap "
    "over runs, of three runs or more.</p>"
)


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of cells that are HTML already."""
    head = "".join(f"<th>{escape(name)}</th>" for name in heads)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _figure(picture: Picture) -> str:
    """Return a figure as a picture of its own: drawn into the page, its parts' names would be another one's too."""
    coded = base64.b64encode(picture.svg.encode()).decode()
    said = escape(picture.says)
    image = f'<img alt="{said}" src="data:image/svg+xml;base64,{coded}">'
    return f'<figure id="{escape(picture.name)}">{image}<figcaption>{said}</figcaption></figure>'


# ------------------------------------------------------------------------------------------------------------ learners


def differences(ours: LearningConfig, other: LearningConfig) -> list[str]:
    """Return what one learner changes of another, key by key in words; name and description are no difference."""
    told: list[str] = []
    for section in ours.__struct_fields__:
        a, b = getattr(ours, section), getattr(other, section)
        if not isinstance(a, msgspec.Struct) or a == b:
            continue
        told += [
            f"{section}.{key} {getattr(a, key)} (not {getattr(b, key)})"
            for key in a.__struct_fields__
            if getattr(a, key) != getattr(b, key)
        ]
    return told


def _learners(groups: Sequence[Group], learners: Mapping[str, LearningConfig]) -> str:
    first = learners.get(groups[0].name) if groups else None
    rows = []
    for group in groups:
        config = learners.get(group.name)
        seeds = ", ".join(str(run.manifest.seed) for run in group.runs)
        if config is None:
            rows.append((escape(group.name), seeds, "not known", ""))
            continue
        told = [] if first is None or config is first else differences(config, first)
        rows.append((escape(group.name), seeds, escape(config.description), "<br>".join(map(escape, told)) or NOTHING))
    against = groups[0].name if groups else ""
    return _table(("learner", "seeds", "what it is", f"changes of {against}"), rows)


# ----------------------------------------------------------------------------------------------------- figures of merit


def _figures_of_merit(report: Report) -> str:
    heads = (
        "learner", "rules from", "learnt", "after epochs", "graph right after", "trials over optimum", "of worst goal",
        "least success at end", "time steps to learnt",
    )  # fmt: skip
    rows = [
        _era(group.name if i == 0 else "", era, group.time_steps_to_all if i == 0 else None)
        for group in report.groups
        for i, era in enumerate(group.eras)
    ]
    return _table(heads, rows)


def _era(name: str, era: EraReport, time_steps: Spread | None) -> tuple[str, ...]:
    after = _spread(era.learnt_after, "{:.0f}") if era.learnt_by_half is None else _reached(era.learnt_by_half)
    right = NOTHING
    if era.graph_right is not None:
        right = f"{_spread(era.graph_right_after, '{:.0f}')}<br>{_count(era.graph_right)}"
    return (
        escape(name), str(era.from_epoch), _count(era.learnt), after, right,
        _spread(era.trials_over_optimum, "{:.2f}"), _spread(era.trials_over_optimum_worst, "{:.2f}"),
        _spread(era.success, "{:.0%}"), "" if time_steps is None else _spread(time_steps, "{:,.0f}"),
    )  # fmt: skip


def _count(count: Count) -> str:
    return f"{count.n} of {count.of}<br>[{count.share_low:.0%}, {count.share_high:.0%}]"


def _reached(reached: Reached) -> str:
    value, low, high = ("never" if x is None else f"{x:.0f}" for x in (reached.value, reached.low, reached.high))
    return f"{value}<br>[{low}, {high}]"


def _spread(spread: Spread, form: str) -> str:
    few = "" if spread.n == spread.of else f"<br>{spread.n} of {spread.of} runs"
    if spread.median is None or spread.least is None or spread.greatest is None:
        return f"{NOTHING}{few}"
    middle, least, greatest = (form.format(x) for x in (spread.median, spread.least, spread.greatest))
    between = "" if spread.middle is None else f"<br>{_interval(spread.middle, form)}"
    return f"{middle} ({least} to {greatest}){few}{between}" if spread.n > 1 else f"{middle}{few}"


def _interval(interval: Interval | None, form: str) -> str:
    if interval is None:
        return NOTHING
    value, low, high = (form.format(x) for x in (interval.value, interval.low, interval.high))
    return f"{value} [{low}, {high}]"


def _is_compared(report: Report) -> bool:
    return any(row.success is not None or row.trials is not None for row in report.comparisons)


def _comparisons(report: Report) -> str:
    rows = [
        (escape(row.ours), escape(row.theirs), str(row.from_epoch), _interval(row.success, "{:.0%}"),
         _interval(row.trials, "{:.0%}"))
        for row in report.comparisons
    ]  # fmt: skip
    said = "<p>The chance that a run of the one is better than a run of the other; 50 % is as good.</p>"
    return said + _table(("a run of", "against one of", "rules from", "has more success", "needs fewer trials"), rows)


# ---------------------------------------------------------------------------------------------------------------- runs


def _runs(groups: Sequence[Group]) -> str:
    rows = [_run(run.folder, run.manifest, run.summary) for group in groups for run in group.runs]
    return _table(("run", "learner", "scenario", "rig", "seed", "epochs", "time steps", "void", "code", "config"), rows)


def _run(folder: str, manifest: Manifest, summary: Summary) -> tuple[str, ...]:
    of = "" if summary.n_epochs == manifest.n_epochs else f" of {manifest.n_epochs}"
    return (
        escape(folder), escape(manifest.learner), escape(manifest.scenario), escape(manifest.rig), str(manifest.seed),
        f"{summary.n_epochs}{of}", f"{summary.n_time_steps:,}", str(summary.n_void_epochs),
        escape((manifest.git or "not known")[:12]), manifest.config_sha256[:12],
    )  # fmt: skip
