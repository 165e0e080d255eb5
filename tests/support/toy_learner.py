"""A toy world and a toy learner, honest and quick: they really move, really learn, and forget nothing.

The world is a flat table of lamps. Touching a lamp lights it for the epoch, if the rules in force let it. The learner
finds out which distance to bring down for each goal, and in which goal-states each goal can come about.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from config.learning import Experiment
from learning.agent import Agent
from learning.interfaces import Attempt, GoalState, Late, TrialOutcome
from learning.seeds import named_generator
from robot.messages import (
    Executed,
    GripState,
    Heading,
    Hold,
    Intent,
    ObjectPercept,
    Percept,
    StationMode,
    StationSpec,
    StationState,
    StepResult,
)

N_GOALS = 4
STEP_M, TOUCH_M, SIDE_M = 0.05, 0.03, 0.6
CHANGE_EPOCH = 60
GRIP = GripState(opening_m=0.08, is_moving=False, has_object=False)


def toy_allowed(goal: int, state: GoalState, epoch: int) -> bool:
    """The toy's rules: 2 needs 0, 3 needs 1 and 2; from the change on 2 needs 0 not lit, 3 needs 1 alone."""
    if epoch < CHANGE_EPOCH:
        return (True, True, state[0], state[1] and state[2])[goal]
    return (True, True, not state[0], state[1])[goal]


class ToyStation:
    """A flat table of lamps behind the Station door."""

    def __init__(self, allowed: Callable[[int, GoalState, int], bool] = toy_allowed, void_epochs: tuple[int, ...] = ()):
        self._allowed = allowed
        self._void_epochs = void_epochs
        self._epoch = 0
        self._stamp_ns = 0
        self._lit = [False] * N_GOALS
        self._places = np.zeros((N_GOALS, 2))
        self._at = np.zeros(2)
        self.n_closed = 0

    @property
    def spec(self) -> StationSpec:
        return StationSpec(
            n_distances=N_GOALS,
            n_buttons=N_GOALS,
            distance_names=tuple(f"lamp_{i}" for i in range(N_GOALS)),
            step_s=0.05,
            max_step_m=STEP_M,
            heights_m=(0.0, 0.1),
            workspace_m=((0.0, 0.0, 0.0), (SIDE_M, SIDE_M, 0.1)),
        )

    @property
    def state(self) -> StationState:
        return StationState(mode=StationMode.ENGAGED)

    def reset(self, *, seed: int, epoch: int) -> Percept:
        rng = np.random.default_rng(seed)
        corners = np.array([[0.1, 0.1], [0.1, 0.5], [0.5, 0.1], [0.5, 0.5]])
        self._places = corners + rng.uniform(-0.05, 0.05, (N_GOALS, 2))
        self._at = rng.uniform(0.25, 0.35, 2)
        self._lit = [False] * N_GOALS
        self._epoch = epoch
        self._stamp_ns = 0
        return self._percept()

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        before = self._at
        if isinstance(intent, Heading):
            move = min(intent.distance_m, STEP_M) * np.array(
                [math.cos(intent.heading_rad), math.sin(intent.heading_rad)]
            )
            self._at = np.clip(self._at + move, 0.0, SIDE_M)
        else:
            assert isinstance(intent, Hold)
        self._stamp_ns += 50_000_000
        for goal in np.flatnonzero(np.hypot(*(self._places - self._at).T) < TOUCH_M):
            if self._allowed(int(goal), tuple(self._lit), self._epoch):
                self._lit[goal] = True
        moved = self._at - before
        executed = Executed(
            duration_s=0.05,
            moved_m=(float(moved[0]), float(moved[1]), 0.0),
            target_m=(float(self._at[0]), float(self._at[1]), 0.05),
        )
        is_void = self._epoch in self._void_epochs and self._stamp_ns >= 100_000_000
        return StepResult(percept=self._percept(), executed=executed, verdicts=(), is_void=is_void)

    def close(self) -> None:
        self.n_closed += 1

    def _percept(self) -> Percept:
        distances = np.hypot(*(self._places - self._at).T)
        objects = tuple(
            ObjectPercept(
                name=f"lamp_{i}",
                position_m=(float(x), float(y), 0.0),
                quat=(1.0, 0.0, 0.0, 0.0),
                age_s=0.0,
                is_valid=True,
            )
            for i, (x, y) in enumerate(self._places)
        )
        return Percept(
            stamp_ns=self._stamp_ns,
            distances_m=tuple(distances.tolist()),
            button_states=tuple(map(float, self._lit)),
            ages_s=(0.0,) * (2 * N_GOALS),
            valid=(True,) * (2 * N_GOALS),
            objects=objects,
            tcp_position_m=(float(self._at[0]), float(self._at[1]), 0.05),
            grip=GRIP,
            is_in_contact=bool((distances < TOUCH_M).any()),
        )


class ToyJudge:
    """Goal i holds where lamp i is lit."""

    n_goals = N_GOALS

    def achieved(self, percept: Percept) -> GoalState:
        return tuple(lamp > 0.5 for lamp in percept.button_states)

    def known(self, percept: Percept, *, since_ns: int | None = None) -> GoalState:
        entries = list(zip(percept.valid, percept.ages_s, strict=True))[N_GOALS:]
        return tuple(
            is_valid and (since_ns is None or percept.stamp_ns - round(age_s * 1e9) >= since_ns)
            for is_valid, age_s in entries
        )

    def is_hand_free(self, goal: int, percept: Percept) -> bool:
        return True

    def is_at_place(self, goal: int, percept: Percept) -> bool:
        return percept.distances_m[goal] < TOUCH_M


class ToyGoalSelector:
    """Draws goals evenly."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.attempts: list[Attempt] = []

    def select(self) -> int:
        return int(self._rng.integers(N_GOALS))

    def temperature(self, goal: int) -> float:
        return 0.1

    def update(self, attempt: Attempt) -> None:
        self.attempts.append(attempt)

    def end_epoch(self, goal: int, *, predicted: float, is_achieved: bool) -> None:
        pass

    def rearm(self, goals: Any) -> None:
        pass

    def state_dict(self) -> dict[str, Any]:
        return {"rng": self._rng.bit_generator.state}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self._rng.bit_generator.state = state["rng"]


class ToySubgoalSelector:
    """Remembers, for each goal-state, which goals came about there and which were blocked; plans by looking ahead."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._verdicts: dict[str, bool] = {}

    def select(
        self, *, goal: int, state: GoalState, available: tuple[bool, ...], temperature: float, explore: bool
    ) -> int:
        if explore and self._rng.random() < temperature:
            return int(self._rng.choice(np.flatnonzero(available)))
        best = self._first_step(goal, state)
        return best if available[best] else int(np.flatnonzero(available)[0])

    def predict_allowed(self, goal: int, state: GoalState) -> float:
        return float(self._verdicts.get(_key(goal, state), True))

    def changed_goals(self) -> tuple[int, ...]:
        return ()

    def update(self, attempt: Attempt) -> None:
        if attempt.outcome in (TrialOutcome.ACHIEVED, TrialOutcome.BLOCKED):
            self._verdicts[_key(attempt.subgoal, attempt.state)] = attempt.outcome is TrialOutcome.ACHIEVED

    def state_dict(self) -> dict[str, Any]:
        return {"rng": self._rng.bit_generator.state, "verdicts": dict(self._verdicts)}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self._rng.bit_generator.state = state["rng"]
        self._verdicts = dict(state["verdicts"])

    def _first_step(self, goal: int, state: GoalState) -> int:
        """First sub-goal of the shortest path of goal-states believed possible."""
        paths: list[tuple[GoalState, int | None]] = [(state, None)]
        seen = {state}
        for at, first in paths:
            for following in range(N_GOALS):
                if at[following] or not self.predict_allowed(following, at):
                    continue
                if following == goal:
                    return following if first is None else first
                then = (*at[:following], True, *at[following + 1 :])
                if then not in seen:
                    seen.add(then)
                    paths.append((then, following if first is None else first))
        return goal


class ToyExperts:
    """Learns which lamp to head for, for each goal."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._worth = np.zeros((N_GOALS, N_GOALS))
        self._results = np.full(N_GOALS, 0.5)
        self._subgoal = self._lamp = 0
        self._explore = False

    @property
    def is_exploring(self) -> bool:
        return False

    def begin_trial(self, subgoal: int, percept: Percept, *, explore: bool) -> None:
        self._subgoal, self._explore = subgoal, explore
        worth = self._worth[subgoal]
        if not explore:
            self._lamp = int(worth.argmax())
            return
        weights = np.exp((worth - worth.max()) / 0.2)
        self._lamp = int(self._rng.choice(N_GOALS, p=weights / weights.sum()))

    def act(self, percept: Percept) -> Heading:
        x, y, _ = percept.tcp_position_m
        to_x, to_y, _ = percept.objects[self._lamp].position_m
        distance = min(STEP_M, math.hypot(to_x - x, to_y - y))
        return Heading(heading_rad=math.atan2(to_y - y, to_x - x), distance_m=distance, height_m=0.05)

    def observe(self, result: StepResult, achieved: GoalState) -> None:
        pass

    def end_trial(self, outcome: TrialOutcome, *, is_fair: bool = True, late: Late | None = None) -> None:
        if not self._explore or outcome is TrialOutcome.VOID:
            return
        if outcome is not TrialOutcome.BLOCKED:
            reward = float(outcome is TrialOutcome.ACHIEVED)
            self._worth[self._subgoal, self._lamp] += 0.3 * (reward - self._worth[self._subgoal, self._lamp])
            self._results[self._subgoal] += 0.2 * (reward - self._results[self._subgoal])

    def utility(self, subgoal: int, percept: Percept) -> float:
        return float(self._worth[subgoal].max())

    def skill(self, subgoal: int) -> float:
        return float(self._results[subgoal])

    def state_dict(self) -> dict[str, Any]:
        return {
            "rng": self._rng.bit_generator.state,
            "worth": self._worth.copy(),
            "results": self._results.copy(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self._rng.bit_generator.state = state["rng"]
        self._worth = state["worth"].copy()
        self._results = state["results"].copy()


class ToyLearner:
    """An agent and its station, as an evaluation worker makes one."""

    def __init__(self, agent: Agent, station: ToyStation) -> None:
        self.agent = agent
        self.station = station

    def close(self) -> None:
        self.station.close()


def make_toy_learner(seed: int, protocol: Experiment, void_epochs: tuple[int, ...] = ()) -> ToyLearner:
    """Return a fresh toy learner."""
    agent = Agent(
        goal_selector=ToyGoalSelector(named_generator(seed, "goals")),
        subgoal_selector=ToySubgoalSelector(named_generator(seed, "subgoals")),
        experts=ToyExperts(named_generator(seed, "experts")),
        judge=ToyJudge(),
        protocol=protocol,
    )
    return ToyLearner(agent, ToyStation(void_epochs=void_epochs))


def toy_maker(seed: int, protocol: Experiment, void_epochs: tuple[int, ...] = ()) -> Callable[[], ToyLearner]:
    """Return what makes the same toy learner in any process."""
    return partial(make_toy_learner, seed, protocol, void_epochs)


def _key(goal: int, state: GoalState) -> str:
    return f"{goal}:{''.join('1' if lit else '0' for lit in state)}"
