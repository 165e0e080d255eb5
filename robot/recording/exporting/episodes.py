"""A session's epochs as arrays: what was known before each time step, what was done in it and for what. The edge.

One row is one time step. Its observation is the percept before it with the joints that were measured then; its action
is the last command of the step that passed the gate: where the joints and the fingers were sent.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt

from robot.bus.topics import ARM_STATE, PERCEPT
from robot.messages import ArmCommand, ArmState, Executed, Percept
from robot.recording.errors import UnfitError
from robot.recording.messages import (
    EpisodeEnd,
    EpisodeMark,
    EpochOutcome,
    GoalChosen,
    Purpose,
    ResetMark,
    StepMark,
    SubgoalChosen,
)
from robot.recording.origin import resolved_of
from robot.recording.session_file import SessionFile
from robot.recording.topics import EPISODE, EPOCH, GOAL, RESET_MARK, STATION, STEP, SUBGOAL

__all__ = ["Course", "Episode", "Names", "courses_of"]

Floats = npt.NDArray[np.float32]
WHOLE = 1e-6
DRIVEN = "drive"
"""What an epoch is for of which nobody said a goal."""


class Names(msgspec.Struct, frozen=True, kw_only=True):
    """What the columns are, the same in all sessions of one data set."""

    robot: str
    fps: int
    """Time steps a second: of a learner, or of a driver."""
    joints: tuple[str, ...]
    """Then the hand's opening (m)."""
    percept: tuple[str, ...]
    """Distances (m), then lamps (0 or 1)."""


class Episode(msgspec.Struct, frozen=True, kw_only=True):
    """One epoch of n time steps."""

    tasks: tuple[str, ...]
    """What each time step was for, by name."""
    stamps_ns: npt.NDArray[np.int64]
    """n + 1: of the percepts, by the plant's clock."""
    joints: Floats
    """(n + 1, 7): joints (rad) and opening (m), as measured with the percept."""
    percepts: Floats
    """(n + 1, k): P(t)."""
    known: npt.NDArray[np.bool_]
    """(n + 1, k): whether each entry of P(t) was valid."""
    actions: Floats
    """(n, 7): joints (rad) and opening (m) that were sent last in the step."""
    void: npt.NDArray[np.bool_]
    """n: cut short; evidence about nothing."""
    is_achieved: bool | None
    """Whether the epoch's goal came about; None where nobody said one."""
    seed: int
    """The table's."""
    epoch: int
    purpose: Purpose

    def __len__(self) -> int:
        return len(self.actions)


class Course(msgspec.Struct, frozen=True, kw_only=True):
    """One session."""

    names: Names
    scenario: str
    episodes: tuple[Episode, ...]


class _Open(msgspec.Struct, kw_only=True):
    """An epoch that is being read."""

    mark: ResetMark
    percepts: list[Percept] = []
    states: list[ArmState] = []
    sent: list[ArmCommand] = []
    durations_s: set[float] = set()
    void: list[bool] = []
    tasks: list[str] = []
    task: str = DRIVEN
    is_achieved: bool | None = None


def courses_of(paths: Sequence[Path]) -> tuple[Course, ...]:
    """Return sessions as episodes, in their order.

    Raises:
        UnfitError: one has no whole epoch, or is of another arm, table or time step than the first.
        DamagedError: one is torn.
    """
    courses = tuple(_course_of(path) for path in paths)
    for path, course in zip(paths, courses, strict=True):
        if course.names != courses[0].names:
            raise UnfitError(
                f"{path}: expected the columns of {paths[0]}, it has others (another arm, table or time step): export "
                "it into a data set of its own"
            )
    return courses


def _course_of(path: Path) -> Course:
    with SessionFile(path) as session:
        resolved = resolved_of(session)
        spec = next((message.spec for _, _, message in session.messages(STATION)), None)
        if spec is None:
            raise UnfitError(f"{path}: expected what station it was recorded at, it does not say")
        joints = tuple(joint.name for joint in resolved.arm.joints)
        epochs = [epoch for epoch in _epochs_of(session) if epoch.sent]
        names = Names(
            robot=resolved.arm.name, fps=_steps_a_second(path, epochs), joints=joints,
            percept=(*spec.distance_names, *(f"lamp_{button.name}" for button in resolved.scenario.buttons)),
        )  # fmt: skip
    return Course(names=names, scenario=resolved.scenario.name, episodes=tuple([_closed(epoch) for epoch in epochs]))


def _steps_a_second(path: Path, epochs: Sequence[_Open]) -> int:
    """Return how many time steps make a second: a learner's are longer than a driver's.

    Raises:
        UnfitError: there is none, they are not all of one length, or no whole number of them makes a second.
    """
    durations_s = sorted(set().union(*(epoch.durations_s for epoch in epochs)))
    if not durations_s:
        raise UnfitError(f"{path}: expected an epoch with time steps, it has none")
    n = round(1.0 / durations_s[0])
    if len(durations_s) > 1 or abs(n * durations_s[0] - 1.0) > WHOLE:
        told = ", ".join(f"{duration:g}" for duration in durations_s)
        raise UnfitError(
            f"{path}: expected time steps of one length, some number of which makes a second; they last {told} s: "
            "`autotelic session cut` takes a part"
        )
    return n


def _epochs_of(session: SessionFile) -> Iterator[_Open]:
    """Yield what was recorded of each epoch; a time step counts once its percept has come and a command was sent."""
    epoch: _Open | None = None
    state: ArmState | None = None
    mark: ResetMark | None = None
    for _, _, message in session.messages(ARM_STATE, PERCEPT, RESET_MARK, EPISODE, STEP, GOAL, SUBGOAL, EPOCH):
        if isinstance(message, ResetMark):
            if epoch is not None:
                yield epoch
            epoch, mark = _Open(mark=message), message
        elif isinstance(message, EpisodeMark):
            if epoch is not None and message.end in (None, EpisodeEnd.KEPT):
                yield epoch
            epoch = None if message.end is not None or mark is None else _Open(mark=mark)
        elif isinstance(message, ArmState):
            state = message
        elif epoch is not None:
            _take(epoch, message, state)
    if epoch is not None:
        yield epoch


def _take(epoch: _Open, message: object, state: ArmState | None) -> None:
    """Take up what comes in the order of a session: after each step its percept, and then what the step came to."""
    match message:
        case Percept():
            if state is not None:
                _see(epoch, message, state)
        case StepMark(executed=executed, is_void=is_void):
            if len(epoch.percepts) == len(epoch.sent) + 2:
                _step(epoch, executed, is_void=is_void)
        case GoalChosen(name=name) | SubgoalChosen(name=name):
            epoch.task = name
        case EpochOutcome(is_achieved=is_achieved):
            epoch.is_achieved = is_achieved
        case _:
            pass


def _see(epoch: _Open, percept: Percept, state: ArmState) -> None:
    if len(epoch.percepts) == len(epoch.sent) + 2:
        del epoch.percepts[-1], epoch.states[-1]  # a newer one before the step was told
    epoch.percepts.append(percept)
    epoch.states.append(state)


def _step(epoch: _Open, executed: Executed, *, is_void: bool) -> None:
    if executed.sent is None or not executed.duration_s:  # not begun: what is seen now is what the next begins with
        del epoch.percepts[-2], epoch.states[-2]
        return
    epoch.sent.append(executed.sent)
    epoch.durations_s.add(executed.duration_s)
    epoch.void.append(is_void)
    epoch.tasks.append(epoch.task)


def _closed(epoch: _Open) -> Episode:
    n = len(epoch.sent)
    percepts, states = epoch.percepts[: n + 1], epoch.states[: n + 1]
    return Episode(
        tasks=tuple(epoch.tasks),
        stamps_ns=np.array([percept.stamp_ns for percept in percepts], dtype=np.int64),
        joints=np.array([(*state.q_rad, state.grip.opening_m) for state in states], dtype=np.float32),
        percepts=np.array([(*p.distances_m, *p.button_states) for p in percepts], dtype=np.float32),
        known=np.array([p.valid for p in percepts], dtype=np.bool_),
        actions=np.array([(*command.q_rad, command.grip.opening_m) for command in epoch.sent], dtype=np.float32),
        void=np.array(epoch.void, dtype=np.bool_),
        is_achieved=epoch.is_achieved, seed=epoch.mark.seed, epoch=epoch.mark.epoch, purpose=epoch.mark.purpose,
    )  # fmt: skip
