"""All experts of a learner behind one door: who moves the arm in a trial, and who learns from it.

At each time step candidate moves are rated by the utility that the sub-goal's model expects where the forward model
says they lead. Before a model has seen enough success, curiosity moves the arm instead, and a goal reached by accident
gives its own model a trace. Everything here sees P(t), intents, the shaped target (the geometric forward model also
where things are) and whether the fingers are moving, for a hand at work is no stillness; goals are indices.
"""

from typing import Any

import numpy as np

from config.learning import LearningConfig
from learning.actions import Candidates, heading_of
from learning.boredom import Boredom
from learning.forward_model import make_forward_model
from learning.interfaces import GoalState, Late, TrialOutcome
from learning.networks import normalised
from learning.novelty import Curiosity, NoveltyMemory
from learning.utility_model import UtilityModel
from robot.messages import Heading, Percept, StationSpec, StepResult

__all__ = ["ExpertSet"]

Array = np.ndarray

FIRST_TRUST = 0.3
"""Share of trials in which a model moves the arm after its first success; it rises to 1 when it is established."""
STUCK_STEPS = 9
STUCK_M = 0.004
"""A model is stuck where every distance is within this of what it was at the first of so many steps."""
REST_STEPS = 10
"""More steps than these must be done, of a trial or after a detour, before a model can count as stuck."""
STILL_STEPS = 5
"""Nothing moves where every distance is within STUCK_M of what it was at the first of so many steps."""
REMEMBER_EVERY = 4


class ExpertSet:
    """One utility model a goal, one forward model, one curiosity."""

    def __init__(self, config: LearningConfig, spec: StationSpec, *, n_goals: int, rng: np.random.Generator) -> None:
        self._config, self._spec = config.expert, spec
        self._scales_m = config.expert.scales_m
        streams = rng.spawn(n_goals + 2)
        self._models = [self._model(stream) for stream in streams[2:]]
        self._rng = streams[0]
        self._forward = make_forward_model(config.forward_model, spec, streams[1])
        n_inputs = len(self._models[0].weights)
        skip = spec.n_distances if config.novelty.near_only else 0
        self._memory = NoveltyMemory(config.novelty.memory, n_inputs, skip=skip)
        self._curiosity = Curiosity(
            config.novelty, spec, forward=self._forward, memory=self._memory, scales_m=self._scales_m, rng=self._rng
        )
        self._candidates = Candidates(spec, config.actions)
        self._boredom = Boredom(n_inputs, height=config.expert.boredom, sigma=config.expert.boredom_sigma)
        self._begin(0, explore=False, is_by_model=True)

    def _model(self, rng: np.random.Generator) -> UtilityModel:
        spec = self._spec
        return UtilityModel(self._config, n_distances=spec.n_distances, n_states=spec.n_buttons, rng=rng)

    def grow(self, n_goals: int) -> None:
        """Take in new goals, each with a model of its own that has seen nothing; the others stay as they are."""
        # Not by spawning: how often a generator has spawned is no part of its state, and lost with a resume.
        seeds = self._rng.integers(2**63, size=n_goals - len(self._models))
        self._models += [self._model(np.random.default_rng(int(seed))) for seed in seeds]

    def _resize(self, n_goals: int) -> None:
        """Have so many models, for a state to be put into them."""
        more = range(n_goals - len(self._models))
        self._models = [*self._models[:n_goals], *(self._model(np.random.default_rng(0)) for _ in more)]

    def _begin(self, subgoal: int, *, explore: bool, is_by_model: bool) -> None:
        self._subgoal, self._is_learning, self._is_by_model = subgoal, explore, is_by_model
        self._is_by_curiosity = False
        self._intent = Heading(heading_rad=0.0, distance_m=0.0, height_m=0.0)
        self._trace: list[Array] = []
        """Normalised P's that the moves of this trial were to lead to."""
        self._distances_m: list[Array] = []
        self._boredom.begin()
        self._dead_ends: list[Array] = []
        self._came_about: list[tuple[int, Array, Array]] = []
        """Goals that came about, each with its trace and the distances at its end."""
        self._n_steps = 0
        self._detour = 0
        self._was_stuck = False
        self._n_still = 0
        self._rested_at = REST_STEPS

    @property
    def is_exploring(self) -> bool:
        """Whether curiosity, and not the sub-goal's model, chose the newest intent."""
        return self._is_by_curiosity

    def begin_trial(self, subgoal: int, percept: Percept, *, explore: bool) -> None:
        """Start a trial; without explore nothing is drawn and nothing learnt changes."""
        self._forward.begin(percept)
        self._curiosity.begin()
        is_by_model = True
        if explore:
            n = self._models[subgoal].n_successes
            trust = min(1.0, FIRST_TRUST + (1.0 - FIRST_TRUST) * n / self._config.established_after) if n else 0.0
            is_by_model = bool(self._rng.random() < trust)
        self._begin(subgoal, explore=explore, is_by_model=is_by_model)

    def act(self, percept: Percept) -> Heading:
        """Return the next intent."""
        states = np.array(percept.button_states, dtype=np.float32)
        self._note_stillness(percept)
        if self._is_learning and self._is_by_model and self._config.detour:
            self._note_stuck()
        self._is_by_curiosity = not self._is_by_model or self._detour > 0
        if not self._is_by_curiosity:
            asked, x = self._best(states)
        else:
            asked = self._curiosity.act(percept)
            x = normalised(self._forward.predict(asked[None]), states, self._scales_m)[0]
            self._detour = max(0, self._detour - 1)
        if self._is_learning:
            self._trace.append(x)
        self._intent = heading_of(asked)
        return self._intent

    def _best(self, states: Array) -> tuple[Array, Array]:
        """Return the candidate of greatest expected utility, and the P it leads to."""
        model = self._models[self._subgoal]
        asked = self._candidates.asked(self._rng.random() if self._is_learning else 0.0)
        x = normalised(self._forward.predict(asked), states, self._scales_m)
        weighted = x * model.weights
        best = int(np.argmax(model.rate_weighted(weighted) - self._boredom.of(weighted)))
        self._boredom.add(weighted[best], n_still=self._n_still)
        return asked[best], x[best]

    def _note_stillness(self, percept: Percept) -> None:
        """Count the steps in which nothing moved; a hand at work is no stillness."""
        self._distances_m.append(np.array(percept.distances_m))
        is_still = not percept.grip.is_moving and self._change(STILL_STEPS) < STUCK_M
        self._n_still = self._n_still + 1 if is_still else 0

    def _change(self, n_steps: int) -> float:
        """Return the greatest change of a distance since the first of the last steps, infinite if that is too early."""
        if len(self._distances_m) < n_steps:
            return np.inf
        return float(np.abs(self._distances_m[-1] - self._distances_m[-n_steps]).max())

    def _note_stuck(self) -> None:
        """A model that holds the arm where nothing happens is shown its error, and curiosity takes over for a while."""
        is_early = self._n_steps <= self._rested_at
        if self._detour or is_early or not self._n_still or self._change(STUCK_STEPS) >= STUCK_M:
            return
        self._was_stuck = True
        self._dead_ends.append(np.array(self._trace[-STUCK_STEPS:]))
        self._trace = self._trace[-1:]
        self._detour = self._config.detour
        self._rested_at = self._n_steps + self._config.detour + REST_STEPS
        self._curiosity.begin()

    def observe(self, result: StepResult, achieved: GoalState) -> None:
        """Take in what the step came to; achieved tells every goal that came about in this very step."""
        self._forward.observe(self._intent, result, is_learning=self._is_learning)
        self._n_steps += 1
        if not self._is_learning:
            return
        if self._n_steps % REMEMBER_EVERY == 0:
            self._memory.add(self._trace[-1])
        self._note_achieved(result.percept, achieved)

    def _note_achieved(self, percept: Percept, achieved: GoalState) -> None:
        for goal, is_achieved in enumerate(achieved):
            if is_achieved:
                self._came_about.append((goal, np.array(self._trace), np.array(percept.distances_m)))

    def end_trial(self, outcome: TrialOutcome, *, is_fair: bool = True, late: Late | None = None) -> None:
        """Close the trial, learn what it showed and train.

        A blocked trial says nothing against the skill, not even where the arm got stuck, nor does a miss that was no
        fair try, as with a full hand; a void one says nothing at all.
        """
        if not self._is_learning or outcome is TrialOutcome.VOID:
            return
        if late is not None and self._trace:
            # The trace ends with the trial: what was moved since was moved to see, and led to nothing.
            self._note_achieved(late.percept, late.achieved)
        model = self._models[self._subgoal]
        is_missed = outcome is TrialOutcome.NOT_REACHED
        for goal, trace, end_m in self._came_about:
            self._models[goal].succeed(trace, end_m, is_own=goal == self._subgoal)
        if not (outcome is TrialOutcome.BLOCKED or (is_missed and not is_fair)):
            for dead_end in self._dead_ends:
                model.fail(dead_end)
            if is_missed and self._trace:
                model.fail(np.array(self._trace))
            if self._is_by_model:
                model.count(is_success=not is_missed, is_clean=not is_missed and not self._was_stuck)
            model.train()
        for goal in sorted({goal for goal, _, _ in self._came_about} - {self._subgoal}):
            self._models[goal].train()
        self._forward.train()

    def demonstrate(self, goal: int, distances_m: Array, states: Array, *, is_success: bool) -> None:
        """Take in places that somebody else went through: up to where a goal came about, or where it did not.

        Nothing is said of the model's own skill. Goals are indices; distances (k, n) metres, states (k, m).
        """
        rows = zip(distances_m, states, strict=True)
        trace = np.array([normalised(d[None], s, self._scales_m)[0] for d, s in rows])
        if is_success:
            self._models[goal].succeed(trace, distances_m[-1], is_own=True)
        else:
            self._models[goal].fail(trace)

    def study(self, n_trials: int) -> None:
        """Train every model as much as so many trials would."""
        for model in self._models:
            model.study(n_trials)

    def utility(self, subgoal: int, percept: Percept) -> float:
        """Return the expected probability of achieving the sub-goal from here, in [0, 1]."""
        distances = np.array([percept.distances_m])
        x = normalised(distances, np.array(percept.button_states, dtype=np.float32), self._scales_m)
        return self._models[subgoal].chance(x[0])

    def skill(self, subgoal: int) -> float:
        """Return the measured chance of success where nothing blocks, in [0, 1]."""
        return self._models[subgoal].skill

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generators' states. Between epochs nothing else is held."""
        return {
            "models": [model.state_dict() for model in self._models],
            "forward": self._forward.state_dict(),
            "memory": self._memory.state_dict(),
            "rng": self._rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._resize(len(state["models"]))
        for model, loaded in zip(self._models, state["models"], strict=True):
            model.load_state_dict(loaded)
        self._forward.load_state_dict(state["forward"])
        self._memory.load_state_dict(state["memory"])
        self._rng.bit_generator.state = state["rng"]
