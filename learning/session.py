"""One session of a run: begin it or take it up again, learn, and leave a folder that tells all."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from config.resolved import Resolved, dump_resolved
from learning.agent import Agent
from learning.assembly import RobotLearner, build_agent, learner_maker
from learning.checkpoint import encode
from learning.ended import Ended
from learning.errors import LearningError, RunFolderError
from learning.evaluation_pool import EvaluationPool
from learning.experiment import Experiment, Plan
from learning.experts import ExpertSet
from learning.offline import teach
from learning.progress import Progress
from learning.provenance import manifest_of
from learning.recorded import RecordedDecisions, Witnesses
from learning.recording import RecordWanted, open_recording
from learning.run_folder import TAUGHT_NAME, Manifest, RunFolder
from learning.stops import Stops
from learning.stopwatch import Stopwatch
from learning.tables import Tables
from learning.time_spent import TimeSpent
from learning.wanted import Wanted, refuse_another, resolve_wanted
from robot.oracle import rules_oracle
from robot.recording.bus_account import BusAccount
from robot.recording.messages import Purpose
from robot.recording.recording import STATE, Recording
from robot.station import Station

__all__ = ["Session", "open_session"]


class Session:
    """A run that is open for learning. Made by open_session; close it when done."""

    def __init__(
        self,
        *,
        folder: RunFolder,
        resolved: Resolved,
        manifest: Manifest,
        learner: RobotLearner,
        stopwatch: Stopwatch,
        recording: Recording | None = None,
        account: BusAccount | None = None,
    ) -> None:
        self.manifest = manifest
        self.remarks: list[str] = []
        """What a person should know before it goes on."""
        self.state: dict[str, Any] | None = None
        """The checkpoint to go on from."""
        self._folder = folder
        self._resolved = resolved
        self._learner = learner
        self._stopwatch = stopwatch
        self._recording, self._account = recording, account

    @property
    def n_done(self) -> int:
        """Epochs done before this session."""
        return 0 if self.state is None else self.state["n_done"]

    def teach(self, paths: Sequence[Path]) -> None:
        """Show sessions to the learner before it begins, and keep in the folder what it was shown.

        Raises:
            SessionError: one is torn, or of another scenario, or they show nothing.
            LearningError: its experts stray.
        """
        learner = self._learner
        experts = learner.agent.experts
        if not isinstance(experts, ExpertSet):
            raise LearningError("expected experts whose moves are all carried out (expert.carried_out: 1) to teach")
        scenario = self._resolved.scenario.name
        taught = teach(learner.agent, experts, learner.station.spec, paths, scenario=scenario)
        self._folder.write_json(TAUGHT_NAME, taught)
        if self._recording is not None:
            self._recording.recorder.attach(STATE, "application/zip", encode(learner.agent.state_dict()))
        names = [goal.name for goal in self.manifest.goals]
        shown = ", ".join(f"{name} {n}" for name, n in zip(names, taught.ways_by_goal, strict=True))
        self.remarks.append(f"taught by {taught.n_sessions} sessions, {taught.n_epochs} epochs; ways shown: {shown}")

    def run(self, progress: Progress, *, n_workers: int, should_stop: Callable[[], bool]) -> Ended:
        """Learn until all epochs are done or a stop is asked for.

        Where the time went is kept in the folder with every checkpoint, added to what earlier sessions kept; a session
        that runs no epoch leaves that as it is.

        Args:
            progress: is told how it goes.
            n_workers: evaluation processes beside this one.
            should_stop: asked at each epoch's end.
        """
        manifest, state = self.manifest, self.state
        learner = self._learner
        before = self._folder.time_spent() if self.n_done else TimeSpent()
        stopped = (self._folder.stops() if self.n_done else None) or Stops()

        def keep(spent: TimeSpent) -> None:
            self._folder.keep_time_spent(spent)
            self._folder.keep_stops(stopped + learner.stops)

        self._stopwatch.lap("start-up")
        learning_station, heard = self._station(Purpose.LEARN), self._heard()
        self._open_account()
        pool = EvaluationPool(
            tester=build_agent(self._resolved, learner.station.spec, seed=manifest.seed),
            station=self._station(Purpose.TEST),
            make_learner=learner_maker(self._resolved, seed=manifest.seed),
            n_workers=n_workers,
            report=progress.say,
        )
        with pool, Tables(self._folder.path, n_rows=None if state is None else state["n_rows"]) as tables:
            experiment = Experiment(
                plan=Plan(
                    seed=manifest.seed,
                    protocol=self._resolved.learning.experiment,
                    changes=manifest.changes,
                    arrivals=manifest.arrivals,
                ),
                agent=learner.agent,
                station=learning_station,
                pool=pool,
                tables=tables,
                store=self._folder.checkpoints,
                watcher=progress,
                oracle=rules_oracle(self._resolved),
                stopwatch=self._stopwatch,
                when_kept=lambda: keep(before + self._spent(progress)),
                when_captured=lambda n_done, agent: self._captured(heard, n_done, agent),
            )
            if state is not None:
                experiment.restore(state)
            n_done = experiment.run(should_stop)
        spent = before
        if n_done > self.n_done:
            spent += self._spent(progress)
            keep(spent)
        return Ended(n_done=n_done, n_epochs=manifest.n_epochs, spent=spent)

    def _station(self, purpose: Purpose) -> Station:
        station: Station = self._learner.station
        learner = self._learner
        if self._recording is not None:
            station = self._recording.station(station, purpose=purpose, measure=learner.measured, ticks=learner.ticks)
        if self._account is not None:
            station = self._account.station(station, purpose=purpose)
        return station

    def _heard(self) -> tuple[RecordedDecisions, ...]:
        """Let the agent's decisions be recorded, where a run is, and told, where a recorder on a bus may hear them."""
        names = [goal.name for goal in self.manifest.goals]
        heard = tuple(RecordedDecisions(r, names) for r in (self._recording, self._account) if r is not None)
        if heard:
            self._learner.agent.witness = Witnesses(*heard)
        return heard

    def _open_account(self) -> None:
        if self._account is not None:
            agent = self._learner.agent.state_dict() if self.state is None else self.state["agent"]
            self._account.open(self.n_done, encode(agent))

    def _captured(self, heard: tuple[RecordedDecisions, ...], n_done: int, agent: Agent) -> None:
        for recorded in heard:
            recorded.captured(n_done, agent)
        if self._account is not None:
            self._account.kept(n_done, lambda: encode(agent.state_dict()))

    def _spent(self, progress: Progress) -> TimeSpent:
        return TimeSpent(
            seconds=self._stopwatch.now_s() - self._stopwatch.started_s,
            n_decisions=progress.n_steps,
            seconds_by_layer=dict(self._stopwatch.seconds_by_layer),
        )

    def close(self) -> None:
        """Release the station and finish what was recorded. Idempotent."""
        if self._account is not None:
            self._account.close()  # before its bus is closed with the station
        self._learner.close()
        if self._recording is not None:
            self._recording.close()


def open_session(
    folder: RunFolder,
    wanted: Wanted,
    *,
    resume: bool,
    stopwatch: Stopwatch,
    consent: Callable[[Resolved, int], None] = lambda _resolved, _n_done: None,
    record: RecordWanted | None = None,
    taught_by: Sequence[Path] = (),
) -> Session:
    """Begin a run in a folder, or read where the run that it holds was left.

    Args:
        folder: the run's folder, entered.
        wanted: what was asked for; where a run is gone on with, it must not be another.
        resume: go on with the run that the folder holds, if it holds one.
        stopwatch: hears of every layer's time.
        consent: is told what the run is made of and how many epochs are done, before any arm is connected to; raises
            where it shall not go on.
        record: where this session is recorded; None records nothing.
        taught_by: sessions that a new run's learner is shown before it begins.

    Raises:
        ConfigError: a config file is missing or wrong.
        RunFolderError: the folder holds a run that is not to be resumed, or another one, or something else; or its
            config is not the one that the run began with.
    """
    if resume and folder.holds_run():
        if taught_by:
            raise RunFolderError(f"{folder.path} holds a run: expected no --from, a learner is taught before it begins")
        return _take_up(folder, wanted, stopwatch, consent, record)
    folder.refuse_unless_empty()
    resolved = resolve_wanted(wanted)
    consent(resolved, 0)
    session = _assemble(folder, resolved, wanted.seed or 0, stopwatch, record)
    if taught_by:
        session.teach(taught_by)
    folder.start(session.manifest, dump_resolved(resolved))
    return session


def _take_up(
    folder: RunFolder,
    wanted: Wanted,
    stopwatch: Stopwatch,
    consent: Callable[[Resolved, int], None],
    record: RecordWanted | None,
) -> Session:
    then, resolved = folder.manifest(), folder.config()
    folder.refuse_changed_config()
    refuse_another(wanted, str(folder.path), resolved, then.seed)
    state, passed_over = folder.checkpoints.newest() if folder.checkpoints.exists() else (None, [])
    consent(resolved, 0 if state is None else state["n_done"])
    session = _assemble(folder, resolved, then.seed, stopwatch, record, state)
    session.remarks += _differences(then, session.manifest)
    session.remarks += [f"passed over a torn checkpoint: {reason}" for reason in passed_over]
    if resolved.rig.bus is not None and state is not None:
        session.remarks.append("the arm runs by the wall clock: what was learnt goes on, but not bit for bit")
    return session


def _assemble(
    folder: RunFolder,
    resolved: Resolved,
    seed: int,
    stopwatch: Stopwatch,
    record: RecordWanted | None,
    state: dict[str, Any] | None = None,
) -> Session:
    recording = None if record is None else open_recording(record, folder, resolved, seed=seed, state=state)
    try:
        learner = RobotLearner(
            resolved, seed=seed, stopwatch=stopwatch,
            tap=None if recording is None else recording.ticks,
        )  # fmt: skip
    except BaseException:
        if recording is not None:
            recording.close()
        raise
    manifest = manifest_of(
        resolved,
        seed=seed,
        oracle=rules_oracle(resolved),
        identity=learner.identity,
        model_sha256=learner.model_sha256,
    )
    session = Session(
        folder=folder, resolved=resolved, manifest=manifest, learner=learner, stopwatch=stopwatch, recording=recording,
        account=learner.account(resolved, seed=seed),
    )  # fmt: skip
    session.state = state
    return session


def _differences(then: Manifest, now: Manifest) -> list[str]:
    """Say what has changed since the run began that could change its course."""
    changed = [
        f"{name} was {then.versions.get(name)}, is {version}"
        for name, version in now.versions.items()
        if then.versions.get(name) != version
    ]
    changed += ["the plant's model is another"] if then.model_sha256 != now.model_sha256 else []
    return [f"since the run began, {'; '.join(changed)}: it may go on differently"] if changed else []
