"""What a learner decides and what becomes of it, on its way into a session."""

from collections.abc import Sequence
from typing import Protocol

from learning.agent import Agent, EpochRecord, TrialRecord, Witness
from learning.fingerprint import fingerprint
from robot.recording.messages import EpochOutcome, GoalChosen, Kept, SubgoalChosen, TrialEvidence
from robot.recording.taps import Heard, Writes
from robot.recording.topics import EPOCH, EVIDENCE, GOAL, KEPT, SUBGOAL

__all__ = ["Recorded", "RecordedDecisions", "Witnesses"]


class Recorded(Protocol):
    """A recording: in a file of this process's own, or an account that a recorder on the bus writes down."""

    @property
    def recorder(self) -> Writes:
        """What takes messages."""
        ...

    @property
    def heard(self) -> Heard:
        """Digest of percepts and outcomes."""
        ...

    def at_ns(self) -> int:
        """Return the session's time."""
        ...


class RecordedDecisions:
    """Implements learning.agent.Witness for a recording.

    Args:
        recording: takes it.
        names: of the goals.
    """

    def __init__(self, recording: Recorded, names: Sequence[str]) -> None:
        self._recording, self._names = recording, tuple(names)
        self._recorder, self._at_ns = recording.recorder, recording.at_ns

    def epoch_begun(self, epoch: int, goal: int) -> None:
        """Record the goal."""
        chosen = GoalChosen(epoch=epoch, goal=goal, name=self._names[goal])
        self._recorder.write(GOAL, chosen, log_ns=self._at_ns())

    def subgoal_chosen(self, *, epoch: int, trial: int, goal: int, subgoal: int) -> None:
        """Record the sub-goal."""
        chosen = SubgoalChosen(epoch=epoch, trial=trial, goal=goal, subgoal=subgoal, name=self._names[subgoal])
        self._recorder.write(SUBGOAL, chosen, log_ns=self._at_ns())

    def trial_ended(self, record: TrialRecord) -> None:
        """Record what the trial showed."""
        attempt = record.attempt
        evidence = TrialEvidence(
            epoch=attempt.epoch,
            trial=record.trial,
            goal=attempt.goal,
            subgoal=attempt.subgoal,
            outcome=attempt.outcome.value,
            state=attempt.state,
            state_after=attempt.state_after,
            predicted=attempt.predicted,
            skill=attempt.skill,
            n_steps=attempt.n_steps,
            is_explored=attempt.is_explored,
        )
        self._recorder.write(EVIDENCE, evidence, log_ns=self._at_ns())

    def epoch_ended(self, record: EpochRecord) -> None:
        """Record what the epoch came to."""
        outcome = EpochOutcome(
            epoch=record.epoch,
            goal=record.goal,
            is_achieved=record.is_achieved,
            is_void=record.is_void,
            n_trials=len(record.trials),
            n_steps=record.n_steps,
        )
        self._recorder.write(EPOCH, outcome, log_ns=self._at_ns())

    def captured(self, n_done: int, agent: Agent) -> None:
        """Record a fingerprint of everything learnt."""
        kept = Kept(n_done=n_done, sha256=fingerprint(agent.state_dict()), heard=self._recording.heard.hexdigest())
        self._recorder.write(KEPT, kept, log_ns=self._at_ns())


class Witnesses:
    """Several in place of one."""

    def __init__(self, *witnesses: Witness) -> None:
        self._witnesses = witnesses

    def epoch_begun(self, epoch: int, goal: int) -> None:
        """Tell each."""
        for witness in self._witnesses:
            witness.epoch_begun(epoch, goal)

    def subgoal_chosen(self, *, epoch: int, trial: int, goal: int, subgoal: int) -> None:
        """Tell each."""
        for witness in self._witnesses:
            witness.subgoal_chosen(epoch=epoch, trial=trial, goal=goal, subgoal=subgoal)

    def trial_ended(self, record: TrialRecord) -> None:
        """Tell each."""
        for witness in self._witnesses:
            witness.trial_ended(record)

    def epoch_ended(self, record: EpochRecord) -> None:
        """Tell each."""
        for witness in self._witnesses:
            witness.epoch_ended(record)
