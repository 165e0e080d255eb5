"""What an agent without our layers reaches, by time steps: rows of tests, and how they are kept."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import msgspec

from learning.checkpoint import write_atomically
from learning.seeds import evaluation_seed

__all__ = ["Course", "Learns", "Score", "Wanted", "read_course", "run_course"]

COURSE_NAME = "course.json"


class Wanted(msgspec.Struct, frozen=True, kw_only=True):
    """What was asked for."""

    agent: str
    scenario: str
    rig: str
    seed: int
    epoch: int
    """Whose rules are in force."""
    n_steps: int
    every: int
    """Time steps between tests."""
    n_tests: int
    """Of each goal."""


class Score(msgspec.Struct, frozen=True, kw_only=True):
    """The tests of all goals after so many time steps of learning; an episode that was cut short failed."""

    n_steps: int
    n_successes: tuple[int, ...]
    """By goal."""
    n_void: tuple[int, ...]
    mean_steps: tuple[float, ...]
    """Time steps an episode took, failures whole."""


class Course(msgspec.Struct, frozen=True, kw_only=True):
    """A run of an agent."""

    wanted: Wanted
    goals: tuple[str, ...]
    scores: tuple[Score, ...] = ()


class Learns(Protocol):
    """An agent on a scene."""

    def learn(self, n_steps: int, *, should_stop: Callable[[], bool], when_stepped: Callable[[], object]) -> None:
        """Learn for so many time steps more, or until a stop is asked for."""
        ...

    def test(self, goal: int, *, seed: int) -> tuple[bool, bool, int]:
        """Return whether a goal came about, whether that was void, and the time steps."""
        ...

    def keep(self, folder: Path) -> None:
        """Write what was learnt."""
        ...


def read_course(folder: Path) -> Course | None:
    """Return what a folder holds, None where nothing was begun."""
    try:
        return msgspec.json.decode((folder / COURSE_NAME).read_bytes(), type=Course)
    except FileNotFoundError:
        return None


def run_course(
    agent: Learns,
    course: Course,
    folder: Path,
    *,
    should_stop: Callable[[], bool],
    when_stepped: Callable[[], object] = lambda: None,
    when_tested: Callable[[Score], object] = lambda _: None,
) -> Course:
    """Let an agent learn and test it every so often, until all time steps are done or a stop is asked for.

    What was learnt and what it came to are kept at each test: at the most the time steps since then are lost.
    """
    wanted = course.wanted
    while not should_stop() and _n_done(course) < wanted.n_steps:
        n_next = min(_n_done(course) + wanted.every, wanted.n_steps)
        agent.learn(n_next - _n_done(course), should_stop=should_stop, when_stepped=when_stepped)
        if should_stop():
            break
        score = _test(agent, course, n_next)
        course = msgspec.structs.replace(course, scores=(*course.scores, score))
        agent.keep(folder)
        write_atomically(folder / COURSE_NAME, msgspec.json.format(msgspec.json.encode(course), indent=1) + b"\n")
        when_tested(score)
    return course


def _n_done(course: Course) -> int:
    return course.scores[-1].n_steps if course.scores else 0


def _test(agent: Learns, course: Course, n_steps: int) -> Score:
    wanted = course.wanted
    seen = [
        [agent.test(g, seed=_seed(wanted, n_steps, g, i)) for i in range(wanted.n_tests)]
        for g in range(len(course.goals))
    ]
    return Score(
        n_steps=n_steps,
        n_successes=tuple(sum(is_success for is_success, _, _ in row) for row in seen),
        n_void=tuple(sum(is_void for _, is_void, _ in row) for row in seen),
        mean_steps=tuple(sum(n for _, _, n in row) / len(row) for row in seen),
    )


def _seed(wanted: Wanted, n_steps: int, goal: int, test: int) -> int:
    """Return the seed of one test; Gymnasium takes 32 bits."""
    whole = evaluation_seed(wanted.seed, epoch=n_steps, rules_epoch=wanted.epoch, goal=goal, test=test)
    return whole & 0xFFFFFFFF
