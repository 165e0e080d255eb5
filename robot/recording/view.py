"""Figures of a session: what was measured and asked, what was perceived, what was decided, what safety said."""

from pathlib import Path
from typing import Any

import msgspec
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from robot.bus.topics import ARM_STATE, PERCEPT, SENT, VERDICT
from robot.messages import Outcome
from robot.recording.errors import UnfitError
from robot.recording.messages import Purpose
from robot.recording.session_file import SessionFile
from robot.recording.topics import EPOCH, EVENT, GOAL, RESET_MARK, STATION, STEP, SUBGOAL

__all__ = ["Drawn", "draw", "save_view"]

WIDE_IN, ROW_IN, DPI = 11.0, 2.1, 110
JOINTS = ("base", "shoulder", "elbow", "wrist 1", "wrist 2", "wrist 3")
MOST_POINTS = 6000
COLOURS = {Outcome.PASSED: "#2b8a3e", Outcome.LIMITED: "#e67700", Outcome.REFUSED: "#c92a2a"}
BANDS = ("#e7f5ff", "#fff3bf")


class Series(msgspec.Struct, kw_only=True):
    """Rows over time."""

    at_s: list[float] = []
    rows: list[tuple[float, ...]] = []

    def add(self, at_ns: int, row: tuple[float, ...]) -> None:
        """Add a row."""
        self.at_s.append(at_ns / 1e9)
        self.rows.append(row)

    def thinned(self) -> tuple[list[float], list[tuple[float, ...]]]:
        """Return every so many-th row: more than a figure has room for is not drawn."""
        every = 1 + len(self.rows) // MOST_POINTS
        return self.at_s[::every], self.rows[::every]


class Drawn(msgspec.Struct, kw_only=True):
    """What is drawn."""

    measured: Series = msgspec.field(default_factory=Series)
    sent: Series = msgspec.field(default_factory=Series)
    tool: Series = msgspec.field(default_factory=Series)
    distances: Series = msgspec.field(default_factory=Series)
    names: tuple[str, ...] = ()
    verdicts: dict[Outcome, list[float]] = msgspec.field(default_factory=dict)
    limiters: dict[str, list[float]] = msgspec.field(default_factory=dict)
    decided: list[tuple[float, str]] = msgspec.field(default_factory=list)
    """When a sub-goal was chosen, and which."""
    resets: list[float] = msgspec.field(default_factory=list)
    goals: list[tuple[float, str]] = msgspec.field(default_factory=list)
    ended: list[tuple[float, bool]] = msgspec.field(default_factory=list)
    events: list[tuple[float, str]] = msgspec.field(default_factory=list)


def save_view(session: SessionFile, out: Path, *, from_s: float = 0.0, to_s: float | None = None) -> Path:
    """Draw a span of a session and write the picture.

    Raises:
        UnfitError: nothing was measured in it, or it cannot be written.
        DamagedError: a chunk is not whole.
    """
    drawn = _gathered(session, from_s, float("inf") if to_s is None else to_s)
    if not drawn.measured.rows and not drawn.tool.rows:
        raise UnfitError(f"{session.path}: expected measurements or percepts in that span, there are none")
    figure = draw(drawn, title=session.path.name)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(out, dpi=DPI)
    except (OSError, ValueError) as error:
        raise UnfitError(f"{out}: expected a place and a kind of picture to write, {error}") from error
    return out


def draw(drawn: Drawn, *, title: str) -> Figure:
    """Return a figure of rows that share their time."""
    figure = Figure(figsize=(WIDE_IN, 5 * ROW_IN), layout="constrained")
    FigureCanvasAgg(figure)
    joints, tool, distances, verdicts, decisions = figure.subplots(5, 1, sharex=True)
    _joints(joints, drawn)
    _lines(tool, drawn.tool, ("x", "y", "z"), "tool, m")
    _lines(distances, drawn.distances, drawn.names, "distances, m")
    _verdicts(verdicts, drawn)
    _decisions(decisions, drawn)
    for axes in (joints, tool, distances, verdicts):
        for at in drawn.resets:
            axes.axvline(at, color="#adb5bd", linewidth=0.8)
    decisions.set_xlabel("time of the session, s")
    figure.suptitle(title, fontsize=11)
    return figure


def _gathered(session: SessionFile, from_s: float, to_s: float) -> Drawn:
    drawn = Drawn()
    topics = (ARM_STATE, SENT, PERCEPT, VERDICT, STEP, STATION, RESET_MARK, GOAL, SUBGOAL, EPOCH, EVENT)
    for topic, raw, message in session.messages(*topics):
        at = raw.log_ns / 1e9
        if topic is STATION:
            drawn.names = message.spec.distance_names
        elif from_s <= at < to_s:
            _take_in(drawn, topic.name, raw.log_ns, message)
    return drawn


def _take_in(drawn: Drawn, topic: str, at_ns: int, message: Any) -> None:  # noqa: ANN401 - of the topic's kind
    at = at_ns / 1e9
    if topic == PERCEPT.name:
        drawn.tool.add(at_ns, message.tcp_position_m)
        drawn.distances.add(at_ns, message.distances_m)
    elif topic == VERDICT.name:
        drawn.verdicts.setdefault(message.outcome, []).append(at)
    elif topic == STEP.name:
        for name in message.executed.limiters:
            drawn.limiters.setdefault(name, []).append(at)
    elif topic in (ARM_STATE.name, SENT.name):
        (drawn.measured if topic == ARM_STATE.name else drawn.sent).add(at_ns, message.q_rad)
    else:
        _take_in_decision(drawn, topic, at, message)


def _take_in_decision(drawn: Drawn, topic: str, at: float, message: Any) -> None:  # noqa: ANN401
    if topic == RESET_MARK.name:
        drawn.resets.append(at)
        if message.purpose is not Purpose.LEARN:
            drawn.goals.append((at, message.purpose.value))
    elif topic == GOAL.name:
        drawn.goals.append((at, message.name))
    elif topic == SUBGOAL.name:
        drawn.decided.append((at, message.name))
    elif topic == EPOCH.name:
        drawn.ended.append((at, message.is_achieved))
    else:
        drawn.events.append((at, message.what))


def _joints(axes: Axes, drawn: Drawn) -> None:
    at, rows = drawn.measured.thinned()
    asked_at, asked = drawn.sent.thinned()
    for i, name in enumerate(JOINTS):
        (line,) = axes.plot(at, [row[i] for row in rows], linewidth=1.0, label=name)
        axes.plot(asked_at, [row[i] for row in asked], linewidth=0.7, linestyle=":", color=line.get_color())
    axes.set_ylabel("joints, rad\n(dotted: sent)")
    _legend(axes)


def _lines(axes: Axes, series: Series, names: tuple[str, ...], label: str) -> None:
    at, rows = series.thinned()
    for i in range(len(rows[0]) if rows else 0):
        axes.plot(at, [row[i] for row in rows], linewidth=1.0, label=names[i] if i < len(names) else str(i))
    axes.set_ylabel(label)
    _legend(axes)


def _verdicts(axes: Axes, drawn: Drawn) -> None:
    """A row for each verdict, and one for each limiter."""
    rows = [(outcome.value, drawn.verdicts.get(outcome, []), COLOURS[outcome]) for outcome in Outcome]
    rows += [(name, at, "#868e96") for name, at in sorted(drawn.limiters.items())]
    for i, (_, at, colour) in enumerate(rows):
        every = 1 + len(at) // MOST_POINTS
        axes.plot(at[::every], [i] * len(at[::every]), "|", color=colour, markersize=7)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=8)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_ylabel("verdicts")


def _decisions(axes: Axes, drawn: Drawn) -> None:
    """Goals as bands, sub-goals as steps on them, outcomes at their ends."""
    names = sorted({name for _, name in (*drawn.goals, *drawn.decided)})
    end = max([*drawn.measured.at_s[-1:], *drawn.tool.at_s[-1:], 0.0])
    for i, (at, name) in enumerate(drawn.goals):
        until = drawn.goals[i + 1][0] if i + 1 < len(drawn.goals) else end
        axes.axvspan(at, until, color=BANDS[i % 2])
        axes.plot([at, until], [names.index(name)] * 2, color="#1c7ed6", linewidth=5, alpha=0.35)
    for i, (at, name) in enumerate(drawn.decided):
        after = [t for t, _ in (*drawn.decided[i + 1 : i + 2], *drawn.ended) if t > at]
        axes.plot([at, min([*after, end])], [names.index(name)] * 2, color="#1c7ed6", linewidth=1.6)
    for at, is_achieved in drawn.ended:
        axes.plot(at, -0.7, "^" if is_achieved else "x", color="#2b8a3e" if is_achieved else "#c92a2a", markersize=6)
    for at, what in drawn.events:
        axes.annotate(what, (at, -0.7), fontsize=7, rotation=30)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.set_ylim(len(names) - 0.5, -1.2)
    axes.set_ylabel("goal (band)\nsub-goal (line)")


def _legend(axes: Axes) -> None:
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    axes.grid(visible=True, linewidth=0.3)
