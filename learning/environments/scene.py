"""One scene as a Gymnasium environment: a goal an episode, through motion and gate like everything that moves the arm.

An episode is an epoch: the table is laid out anew, one goal is wanted, and it ends when that came about (terminated)
or the time steps of all trials of an epoch are used up (truncated). An episode that a stop, a fault or lost data cut
short is truncated too, and its info says that it is void: it is evidence about nothing.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from config.errors import ConfigError
from config.loader import load_rig, resolve
from learning.environments.rows import (
    FARTHEST_M,
    N_ACTIONS,
    asked,
    intent_of,
    is_achieved,
    n_observed,
    observed,
    one_goal,
)
from learning.goals import GoalJudge
from learning.interfaces import GoalState
from robot.messages import Percept
from robot.operated import OperatedStation, operator_of
from robot.rigs import find_station

__all__ = ["SceneEnv"]

MOST_SEED = 2**63 - 1


class SceneEnv(gymnasium.Env[Any, np.ndarray]):
    """A scenario on a rig in lock-step, goal-conditioned.

    Observations are `observation` (P(t), its validity, tool and hand), `achieved_goal` (which goals came about in this
    episode) and `desired_goal` (the wanted one), all float32. Actions are three numbers from -1 to 1: displacement in
    the plane as shares of the longest step, and height. The reward of a time step is 0 where the goal came about, else
    -1.

    `reset(options=...)` takes `goal`, an index in place of one drawn evenly, and `epoch`, the epoch of the scenario's
    schedule whose rules are in force from then on; the rules themselves nothing tells.

    Args:
        scenario: shipped name or path.
        rig: the same; one in lock-step.
        epoch: whose rules are in force at first.
        goal: always this one; None draws evenly.
        render_mode: there is none.

    Raises:
        ConfigError: a file is missing or wrong, or the rig runs by the wall clock.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(
        self,
        scenario: str = "paper",
        rig: str = "twin",
        *,
        epoch: int = 0,
        goal: int | None = None,
        render_mode: None = None,
    ) -> None:
        if load_rig(rig).address is not None:
            raise ConfigError(
                rig, "address", "a rig in lock-step, whose world waits for each action", "one with an arm"
            )
        resolved = resolve(rig=rig, scenario=scenario)
        protocol = resolved.learning.experiment
        station = find_station(resolved)
        self._station = OperatedStation(station, operator_of(station, resolved.rig))
        self._station.connect()
        self._spec = self._station.spec
        self._judge = GoalJudge(resolved.scenario, self._spec)
        self.goal_names = tuple(each.name for each in resolved.scenario.goals)
        self.render_mode = render_mode
        self.n_steps_most = protocol.trials * protocol.steps
        self._goal_given, self._epoch = goal, epoch
        self._goal, self._n_steps = 0, 0
        self._latched: GoalState = ()
        n_goals = len(self.goal_names)
        some = spaces.Box(0.0, 1.0, (n_goals,), np.float32)
        observation = spaces.Box(-FARTHEST_M, FARTHEST_M, (n_observed(self._spec),), np.float32)
        self.observation_space = spaces.Dict(observation=observation, achieved_goal=some, desired_goal=some)
        self.action_space = spaces.Box(-1.0, 1.0, (N_ACTIONS,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Lay the table out anew and want a goal."""
        super().reset(seed=seed)
        given = options or {}
        unknown = set(given) - {"goal", "epoch"}
        if unknown:
            raise ValueError(f"expected the options goal and epoch, got {', '.join(sorted(unknown))}")
        drawn = int(self.np_random.integers(len(self.goal_names)))
        wanted = given.get("goal", self._goal_given)
        self._goal = drawn if wanted is None else int(wanted)
        if not 0 <= self._goal < len(self.goal_names):
            raise ValueError(f"expected a goal from 0 to {len(self.goal_names) - 1}, got {self._goal}")
        self._epoch = int(given.get("epoch", self._epoch))
        self._n_steps = 0
        percept = self._station.reset(seed=int(self.np_random.integers(MOST_SEED)), epoch=self._epoch)
        self._latched = self._judge.achieved(percept)
        return self._told(percept), self._info(is_void=False)

    def step(self, action: np.ndarray) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """Carry out one time step."""
        result = self._station.step(intent_of(np.asarray(action, dtype=float), self._spec))
        self._n_steps += 1
        if not result.is_void:
            now = self._judge.achieved(result.percept)
            self._latched = tuple(was or is_so for was, is_so in zip(self._latched, now, strict=True))
        told = self._told(result.percept)
        is_there = self._latched[self._goal] and not result.is_void
        is_over = result.is_void or self._n_steps >= self.n_steps_most
        reward = float(self.compute_reward(told["achieved_goal"], told["desired_goal"], {}))
        return told, reward, is_there, is_over and not is_there, self._info(is_void=result.is_void)

    def compute_reward(self, achieved_goal: np.ndarray, desired_goal: np.ndarray, info: object) -> np.ndarray:
        """Return 0 where all that is wanted came about, else -1; of many at once too.  (..., n) -> (...)"""
        del info
        return is_achieved(achieved_goal, desired_goal).astype(np.float32) - 1.0

    def close(self) -> None:
        """Release the station. Idempotent."""
        self._station.close()

    def _told(self, percept: Percept) -> dict[str, np.ndarray]:
        return {
            "observation": observed(percept),
            "achieved_goal": asked(self._latched),
            "desired_goal": one_goal(self._goal, len(self.goal_names)),
        }

    def _info(self, *, is_void: bool) -> dict[str, Any]:
        return {
            "is_success": self._latched[self._goal] and not is_void,
            "is_void": is_void,
            "goal": self._goal,
            "epoch": self._epoch,
        }
