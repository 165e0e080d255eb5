"""A run's epochs lived again on the twin, from its config, its seed and the checkpoints that it kept. State.

In lock-step what was lived once is lived again bit for bit; what comes out is held to the run's own tables.
"""

from collections.abc import Callable
from typing import Any

import msgspec

from config.resolved import Resolved
from learning.agent import EpochRecord, TrialRecord
from learning.assembly import RobotLearner
from learning.checkpoint import CheckpointStore, decode, encode, taking_up
from learning.errors import LearningError
from learning.interfaces import GoalState
from learning.rows import GoalRow, goal_row
from learning.run_folder import RunFolder
from learning.seeds import evaluation_seed, reset_seed
from robot.messages import ArmState, Intent, Percept, StationSpec, StationState, StepResult
from robot.station import Station

__all__ = ["Reliving", "Shot"]


class Shot(msgspec.Struct, frozen=True, kw_only=True):
    """How things were after one time step, and what was being done."""

    state: ArmState
    percept: Percept
    holds: GoalState
    epoch: int
    goal: int
    subgoal: int | None
    """None before the first choice of an epoch."""
    trial: int
    ended: str
    """How the epoch ended, in words; empty while it is under way."""


class Reliving:
    """Lives epochs of a run again. Close it when done.

    Args:
        folder: the run's; it is only read.
        tell: hears how far it is, in words, where epochs that nobody sees must be lived first.
    """

    def __init__(self, folder: RunFolder, *, tell: Callable[[str], object] = lambda _: None) -> None:
        resolved = folder.config()
        _refuse_other_worlds(folder, resolved)
        self._manifest, self._tell = folder.manifest(), tell
        self._rows = {row.epoch: row for row in folder.goals()}
        self._store: CheckpointStore = folder.checkpoints
        self._learner = RobotLearner(resolved, seed=self._manifest.seed)
        self._agent = self._learner.agent
        self._n_goals = len(self._manifest.goals)
        self._states: dict[int, bytes] = {0: encode({"agent": self._agent.state_dict()})}
        """States at the beginning of epochs, by how many were done."""
        self._at: int | None = 0
        """How many epochs the agent has lived, None where it was used for a test since."""
        self._station = _Filmed(self._learner.station)

    def live(self, epoch: int) -> list[Shot]:
        """Return one epoch of learning, as it was.

        Raises:
            LearningError: it came to something else than the run's table tells.
        """
        self._be_at(epoch)
        return self._live(epoch, is_shown=True)

    def test(self, n_learnt: int, *, rules_epoch: int, goal: int) -> list[Shot]:
        """Return a test epoch of what was learnt after so many epochs, the first that an evaluation has."""
        self._be_at(n_learnt)
        self._at = None
        seed = evaluation_seed(self._manifest.seed, epoch=n_learnt, rules_epoch=rules_epoch, goal=goal, test=0)
        with self._filmed() as shots:
            self._agent.test_epoch(self._station, epoch=rules_epoch, seed=seed, goal=goal)
        return shots

    def close(self) -> None:
        """Release the twin. Idempotent."""
        self._learner.close()

    # ------------------------------------------------------------------------------------------------------- inside

    def _be_at(self, epoch: int) -> None:
        """Have lived all epochs before one, beginning from the nearest state that there is."""
        if self._at is None or self._at > epoch or self._nearest(epoch) > self._at:
            self._go_back_to(self._nearest(epoch))
        assert self._at is not None, "it has just been set"
        for between in range(self._at, epoch):
            self._tell(f"living epoch {between} again, on the way to {epoch}")
            self._live(between, is_shown=False)
        if epoch not in self._states:
            self._states[epoch] = encode({"agent": self._agent.state_dict()})

    def _nearest(self, epoch: int) -> int:
        kept = self._store.before(epoch)
        return max([n for n in self._states if n <= epoch] + ([] if kept is None else [int(kept["n_done"])]))

    def _go_back_to(self, n_done: int) -> None:
        if n_done in self._states:
            self._load(decode(self._states[n_done]))
        else:
            kept = self._store.before(n_done)
            assert kept is not None, "it was the nearest"
            self._load(kept)
        self._at = n_done

    def _load(self, state: dict[str, Any]) -> None:
        with taking_up():
            self._agent.load_state_dict(state["agent"])

    def _live(self, epoch: int, *, is_shown: bool) -> list[Shot]:
        agent, seed = self._agent, reset_seed(self._manifest.seed, epoch)
        agent.meet_goals(epoch)
        goal = agent.choose_goal()
        with self._filmed() as shots:
            station = self._station if is_shown else self._learner.station
            record = agent.learn_epoch(station, epoch=epoch, seed=seed, goal=goal)
        self._at = epoch + 1
        self._hold_to_table(goal_row(record))
        return shots

    def _hold_to_table(self, lived: GoalRow) -> None:
        told = self._rows.get(lived.epoch)
        if told != lived:
            raise LearningError(
                f"epoch {lived.epoch}: expected to live again what goals.csv tells ({told}), it came to {lived}: use "
                "the version and libraries that the run was made with (run.json names them)"
            )

    def _filmed(self) -> "_Filming":
        return _Filming(self._learner, self._station, self._n_goals)


class _Filmed:
    """Stands before a station (robot.station.Station) and shows each percept to whoever films."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self.take: Callable[[Percept], object] = lambda _: None

    @property
    def spec(self) -> StationSpec:
        return self._station.spec

    @property
    def state(self) -> StationState:
        return self._station.state

    def reset(self, *, seed: int, epoch: int) -> Percept:
        percept = self._station.reset(seed=seed, epoch=epoch)
        self.take(percept)
        return percept

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        result = self._station.step(intent, duration_s=duration_s)
        self.take(result.percept)
        return result

    def close(self) -> None:
        self._station.close()


class _Filming:
    """While entered, hears what an agent decides (learning.agent.Witness) and takes a shot of every time step."""

    def __init__(self, learner: RobotLearner, station: _Filmed, n_goals: int) -> None:
        self._learner, self._station, self._n_goals = learner, station, n_goals
        self._shots: list[Shot] = []
        self._epoch, self._goal, self._trial = 0, 0, 0
        self._subgoal: int | None = None

    def __enter__(self) -> list[Shot]:
        self._learner.agent.witness = self
        self._station.take = self._take
        return self._shots

    def __exit__(self, *_: object) -> None:
        self._learner.agent.witness = None
        self._station.take = lambda _: None

    def _take(self, percept: Percept) -> None:
        judged = self._learner.agent.judge.achieved(percept)
        holds = (*judged, *(False,) * (self._n_goals - len(judged)))
        self._shots.append(
            Shot(
                state=self._learner.measured(), percept=percept, holds=holds,
                epoch=self._epoch, goal=self._goal, subgoal=self._subgoal, trial=self._trial, ended="",
            )
        )  # fmt: skip

    def epoch_begun(self, epoch: int, goal: int) -> None:
        self._epoch, self._goal, self._trial, self._subgoal = epoch, goal, 0, None

    def subgoal_chosen(self, *, epoch: int, trial: int, goal: int, subgoal: int) -> None:
        del epoch, goal
        self._trial, self._subgoal = trial, subgoal

    def trial_ended(self, record: TrialRecord) -> None:
        """Nothing is shown of it: the next choice, or the epoch's end, is."""

    def epoch_ended(self, record: EpochRecord) -> None:
        n = len(record.trials)
        ended = f"achieved in {n} trial{'' if n == 1 else 's'}" if record.is_achieved else f"not achieved in {n} trials"
        if self._shots:
            self._shots.append(msgspec.structs.replace(self._shots[-1], ended=ended))


def _refuse_other_worlds(folder: RunFolder, resolved: Resolved) -> None:
    if resolved.rig.expected.kind != "twin" or resolved.rig.bus is not None:
        raise LearningError(
            f"{folder.path}: expected a run on a twin in lock-step, which can be lived again, it is on "
            f"{resolved.rig.name}: `autotelic session view --video` films what was recorded of others"
        )
