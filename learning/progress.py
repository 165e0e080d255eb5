"""How a run is going, on the terminal: a bar where there is one, plain lines now and then where there is none."""

from collections import deque
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from learning.agent import EpochRecord
from learning.rows import EvaluationRow

__all__ = ["Progress", "Rate", "Status", "duration_text"]

RECENT = 20
"""Epochs of a goal that its recent success is taken over."""
WINDOW_S = 30.0
LINE_EVERY_S = 10.0
REFRESH_HZ = 4.0


class Rate:
    """Events a second over the recent past."""

    def __init__(self, window_s: float = WINDOW_S) -> None:
        self._window_s = window_s
        self._marks: deque[tuple[float, float]] = deque()

    def mark(self, now_s: float, total: float) -> None:
        """Note how many there were by now."""
        self._marks.append((now_s, total))
        while len(self._marks) > 2 and now_s - self._marks[0][0] > self._window_s:
            self._marks.popleft()

    @property
    def per_s(self) -> float:
        """Mean rate between the oldest and the newest mark, 0 before there are two."""
        if len(self._marks) < 2 or self._marks[-1][0] <= self._marks[0][0]:
            return 0.0
        (start_s, start), (end_s, end) = self._marks[0], self._marks[-1]
        return (end - start) / (end_s - start_s)


class Progress:
    """Watches an experiment (learning.experiment.Watcher)."""

    def __init__(
        self,
        *,
        goals: Sequence[str],
        n_epochs: int,
        n_done: int,
        now_s: Callable[[], float],
        console: Console | None = None,
    ) -> None:
        self._goals = tuple(goals)
        self._n_epochs = n_epochs
        self._n_done = n_done
        self._now_s = now_s
        self._console = console or Console(stderr=True)
        self._recent = [deque[bool](maxlen=RECENT) for _ in goals]
        self._tested: list[float | None] = [None] * len(goals)
        self._goal = 0
        self.n_steps = 0
        self._steps, self._epochs = Rate(), Rate()
        self._shown_s = self._started_s = now_s()
        self._live: Live | None = None
        self._steps.mark(now_s(), 0)
        self._epochs.mark(now_s(), n_done)

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None

    # ------------------------------------------------------------------------------------------------------ watching

    def epoch_begins(self, epoch: int, goal: int) -> None:
        """A goal was chosen."""
        self._n_done, self._goal = epoch, goal
        self._show_now_and_then()

    def epoch_ended(self, record: EpochRecord) -> None:
        """An epoch is over."""
        self._n_done = record.epoch + 1
        self.n_steps += record.n_steps
        if not record.is_void:
            self._recent[record.goal].append(record.is_achieved)
        now_s = self._now_s()
        self._steps.mark(now_s, self.n_steps)
        self._epochs.mark(now_s, self._n_done)

    def goals_met(self, epoch: int, goals: Sequence[int]) -> None:
        """Goals became known."""
        self.say(f"epoch {epoch}: from now on {' and '.join(self._goals[goal] for goal in goals)} can be wanted")

    def evaluated(self, rows: Sequence[EvaluationRow]) -> None:
        """An evaluation is done."""
        for row in rows:
            self._tested[row.goal] = row.success
        if self._live is None:
            shares = " ".join(f"{row.success:.0%}" for row in rows)
            self.say(f"evaluated at epoch {rows[0].epoch}: {shares}")

    def say(self, line: str) -> None:
        """Print a line above the bar, letter by letter: a path or a name in it is no markup."""
        self._console.print(Text(line), soft_wrap=True)

    # ------------------------------------------------------------------------------------------------------- showing

    def _show_now_and_then(self) -> None:
        now_s = self._now_s()
        every_s = LINE_EVERY_S if self._live is None else 1.0 / REFRESH_HZ
        if now_s - self._shown_s < every_s:
            return
        self._shown_s = now_s
        if self._live is None:
            self.say(self.line())
        else:
            self._live.update(self._picture(), refresh=True)

    def line(self) -> str:
        """Return the state of the run in one line."""
        success = " ".join("–" if not recent else f"{_share(recent):.0%}" for recent in self._recent)
        return (
            f"epoch {self._n_done}/{self._n_epochs}, goal {self._goals[self._goal]}, recent success {success}, "
            f"{self._steps.per_s:.0f} decisions/s, {self._time_left()} left"
        )

    def _time_left(self) -> str:
        rate = self._epochs.per_s
        return duration_text((self._n_epochs - self._n_done) / rate) if rate else "?"

    def _picture(self) -> Table:
        head = Text.assemble(
            (f"epoch {self._n_done}/{self._n_epochs}", "bold"),
            "  goal ",
            (self._goals[self._goal], "bold cyan"),
            f"  {self._steps.per_s:.0f} decisions/s  {self._time_left()} left",
        )
        bar = ProgressBar(total=self._n_epochs, completed=self._n_done, width=min(80, self._console.width - 2))
        table = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
        for goal, recent, tested in zip(self._goals, self._recent, self._tested, strict=True):
            marks = "".join("█" if hit else "·" for hit in recent)
            share = "" if not recent else f"{_share(recent):4.0%}"
            table.add_row(Text(goal), share, Text(marks, "green"), "" if tested is None else f"tested {tested:.0%}")
        picture = Table.grid()  # a bar on its own would not end its line
        for part in (head, bar, table):
            picture.add_row(part)
        return picture


class Status:
    """One sentence that changes: in place on a terminal, elsewhere a line every ten seconds at most."""

    def __init__(self, sentence: str, *, now_s: Callable[[], float], console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._now_s, self._shown_s = now_s, now_s()
        self._spinner = self._console.status(Text(sentence)) if self._console.is_terminal else None

    def __enter__(self) -> Self:
        if self._spinner is not None:
            self._spinner.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._spinner is not None:
            self._spinner.stop()

    def __call__(self, sentence: str) -> None:
        """Tell how far it is."""
        if self._spinner is not None:
            self._spinner.update(Text(sentence))
        elif (now_s := self._now_s()) - self._shown_s >= LINE_EVERY_S:
            self._shown_s = now_s
            self._console.print(Text(sentence), soft_wrap=True)


def duration_text(seconds: float) -> str:
    """Return a span of time for people: `1 h 05 min`, `3 min 20 s`, `12 s`."""
    whole = round(seconds)
    if whole >= 3600:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    if whole >= 60:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole} s"


def _share(recent: Sequence[bool] | deque[bool]) -> float:
    return sum(recent) / len(recent)
