"""Jobs under way: which is started next, which again, and which is given up. State, no clock, no terminal."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Protocol

from learning.sweeping.executor import End, Executor, Job

__all__ = ["JobRunner", "Task"]


class Task(Protocol):
    """Something that is run by a job, as often as it takes, and keeps how far it is where that can be read."""

    @property
    def name(self) -> str:
        """Unlike all others'."""
        ...

    def job(self) -> Job:
        """Return what runs it, or the rest of it."""
        ...

    def n_done(self) -> int:
        """Return how far it is; a start that comes no further is in vain."""
        ...

    def is_finished(self) -> bool:
        """Whether nothing of it is left to do."""
        ...


class JobRunner:
    """Runs tasks that are not finished, and those that fail again while they come on.

    Args:
        tasks: all of them.
        executor: runs their jobs.
        tries: starts of a task that come no further, one after the other, after which it is given up.
        tell: hears of what happens, a line each.
        when_failed: hears which task failed, how far it was, and why.

    Attributes:
        tasks: All of them.
        running: Those under way.
        given_up: Those that failed too often without coming on, and why.
    """

    def __init__(
        self,
        tasks: Sequence[Task],
        *,
        executor: Executor,
        tries: int,
        tell: Callable[[str], object],
        when_failed: Callable[[str, int, str], object] = lambda _name, _at, _why: None,
    ) -> None:
        self._executor, self._tries, self._tell, self._when_failed = executor, tries, tell, when_failed
        self.tasks = tuple(tasks)
        self.running: dict[str, Task] = {}
        self.given_up: dict[str, str] = {}
        self._waiting = deque(task for task in self.tasks if not task.is_finished())
        self._begun_at: dict[str, int] = {}
        self._n_vain: dict[str, int] = {}
        """Starts that came no further, one after the other."""
        self._is_stopping = False

    @property
    def n_finished(self) -> int:
        """Tasks of which nothing is left to do."""
        return sum(task.is_finished() for task in self.tasks)

    @property
    def is_over(self) -> bool:
        """Whether nothing runs, and nothing is to be started any more."""
        return not self.running and (self._is_stopping or not self._waiting)

    def look(self) -> None:
        """Take note of what ended, and start what there is room for."""
        for end in self._executor.ended():
            self._take(end)
        while self._waiting and not self._is_stopping and len(self.running) < self._executor.n_slots:
            self._start(self._waiting.popleft())

    def stop(self) -> None:
        """Start nothing any more, and ask what runs to come to an end that loses nothing."""
        if not self._is_stopping:
            self._is_stopping = True
            self._executor.ask_to_stop()

    def _start(self, task: Task) -> None:
        at = self._begun_at[task.name] = task.n_done()
        self.running[task.name] = task
        self._executor.start(task.job())
        self._tell(f"{task.name}: {f'goes on from about epoch {at}' if at else 'begins'}")

    def _take(self, end: End) -> None:
        task = self.running.pop(end.name)
        if task.is_finished():
            self._tell(f"{task.name}: finished")
        elif not self._is_stopping:
            self._fail(task, end.why_failed or "ended before its epochs were done, and said that all was well")

    def _fail(self, task: Task, why: str) -> None:
        at = task.n_done()
        self._when_failed(task.name, at, why)
        n_vain = 0 if at > self._begun_at[task.name] else self._n_vain.get(task.name, 0)
        self._n_vain[task.name] = n_vain + 1
        if self._n_vain[task.name] >= self._tries:
            self.given_up[task.name] = why
            self._tell(f"{task.name}: given up after {self._tries} tries at epoch {at}: {why}")
        else:
            self._waiting.append(task)
            self._tell(f"{task.name}: failed at epoch {at} and is tried again: {why}")
