"""From a resolved config to a learner: an agent of the config's layers, and the rig's station to act through."""

from functools import partial

import torch

from config.resolved import Resolved
from learning.agent import Agent
from learning.evaluation_pool import MakeLearner
from learning.experts import ExpertSet
from learning.goal_selector import GoalSelector
from learning.goals import GoalJudge
from learning.interfaces import Experts
from learning.seeds import named_generator
from learning.stops import Stops, stops_of
from learning.stopwatch import Stopwatch
from learning.straying import StrayingExperts
from learning.subgoal_selector import make_subgoal_selector
from robot.messages import ArmState, PlantIdentity, StationSpec
from robot.operated import OperatedStation, operator_of
from robot.recording.bus_account import BusAccount
from robot.rigs import find_station
from robot.station_doors import Accountable
from robot.tick_ring import TickReader, ticks_of
from robot.tick_tap import TickTap

__all__ = ["RobotLearner", "build_agent", "learner_maker"]


class RobotLearner:
    """An agent and the station it acts through (learning.evaluation.Learner)."""

    def __init__(
        self,
        resolved: Resolved,
        *,
        seed: int,
        stopwatch: Stopwatch | None = None,
        tap: TickTap | None = None,
    ) -> None:
        """Build plant and station, arm it where nobody has to be there for that, and build the agent.

        Args:
            resolved: everything a run is made of.
            seed: root seed of the run.
            stopwatch: hears of every layer's time; None measures nothing.
            tap: hears of every tick, where the arm is held in this process.
        """
        # One small network at a time: more threads cost more than they bring, and the number would change the sums.
        torch.set_num_threads(1)
        lap = None if stopwatch is None else stopwatch.lap
        station = find_station(resolved, heard_by=lap, tap=tap)
        self._local = station
        self.station = OperatedStation(station, operator_of(station, resolved.rig))
        self.station.connect()
        self.identity: PlantIdentity = station.identity
        self.model_sha256: str | None = station.model_sha256
        self.agent = build_agent(resolved, self.station.spec, seed=seed, stopwatch=stopwatch)

    @property
    def stops(self) -> Stops:
        """What stopped the arm so far."""
        return stops_of(self._local.latch_reasons, n_epochs=self.station.n_resets)

    def measured(self) -> ArmState:
        """Return the newest measurement."""
        return self._local.measured

    @property
    def ticks(self) -> TickReader | None:
        """What reads the arm's ticks, where a process of this one's own holds it."""
        return ticks_of(self._local)

    def account(self, resolved: Resolved, *, seed: int) -> BusAccount | None:
        """Return a way to tell a recorder on the bus what is learnt from; None where the arm is held at home."""
        local = self._local
        return BusAccount(local.open_account(), resolved, seed=seed) if isinstance(local, Accountable) else None

    def close(self) -> None:
        """Release the station. Idempotent."""
        self.station.close()


def build_agent(resolved: Resolved, spec: StationSpec, *, seed: int, stopwatch: Stopwatch | None = None) -> Agent:
    """Return an agent that has learnt nothing yet. Its judge alone knows what the goals are about."""
    learning, scenario = resolved.learning, resolved.scenario
    arrivals = tuple(goal.from_epoch for goal in scenario.goals)
    n_goals = arrivals.count(0)
    return Agent(
        goal_selector=GoalSelector(
            n_goals=n_goals,
            config=learning.goal_selection,
            subgoals=learning.subgoal_selection,
            rng=named_generator(seed, "goal_selector"),
        ),
        subgoal_selector=make_subgoal_selector(
            n_goals=n_goals, config=learning.subgoal_selection, rng=named_generator(seed, "subgoal_selector")
        ),
        experts=_experts(resolved, spec, seed=seed),
        judge=GoalJudge(scenario, spec),
        protocol=learning.experiment,
        stopwatch=stopwatch,
        arrivals=arrivals if any(arrivals) else (),
    )


def _experts(resolved: Resolved, spec: StationSpec, *, seed: int) -> Experts:
    learning, n_goals = resolved.learning, sum(goal.from_epoch == 0 for goal in resolved.scenario.goals)
    experts = ExpertSet(learning, spec, n_goals=n_goals, rng=named_generator(seed, "experts"))
    share = learning.expert.carried_out
    return experts if share == 1.0 else StrayingExperts(experts, spec, share=share, seed=seed)


def learner_maker(resolved: Resolved, *, seed: int) -> MakeLearner:
    """Return what makes a learner of its own in another process."""
    return partial(RobotLearner, resolved, seed=seed)
