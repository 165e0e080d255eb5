"""One fault after the other against an arm under way: what was said, how soon, how it rested, what came after."""

import os
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep
from types import TracebackType
from typing import Self

import msgspec

from robot.errors import RobotError
from robot.hal.ur_primary import read_facts
from sim_twin.broken.judge import Judged, Motion
from sim_twin.broken.outcome import Outcome
from sim_twin.broken.pendant import Pendant
from sim_twin.broken.proof import Proof, Shows, Sight
from sim_twin.broken.rider import NEVER_S, Raised, Rider
from sim_twin.broken.trials import JOG_RAD, Moment, Stage, Trial
from sim_twin.broken.tries import DisturbedError, in_peace
from sim_twin.broken.witness import Witness
from sim_twin.controller.process import ControllerProcess, ControllerProcessError, ask_fault
from sim_twin.controller.server import Setup

__all__ = ["Course"]

BORNE_S, BEFORE_S, DURING_S = 2.0, 0.4, 0.7
SETTLE_S, AFTER_S, REST_LIMIT_S = 0.3, 0.5, 8.0


def is_ended(pid: int) -> bool:
    """Return whether a child of this process has ended, waited for or not."""
    try:
        return os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is not None
    except ChildProcessError:
        return True


class Course:
    """A virtual controller, and the whole backend that moves its arm; a fresh pair for every fault.

    Args:
        host: a loopback address that is free.
    """

    def __init__(self, host: str) -> None:
        self._host = host
        self._folder = TemporaryDirectory(prefix="autotelic-faults-")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._folder.cleanup()

    def run(self, trial: Trial) -> Outcome:
        """Put the arm through one fault; begin anew where something else came up before the fault or after it.

        Raises:
            DisturbedError: it did so each time, and this machine was busy elsewhere.
            CutShortError: it did so each time on a machine that had time to spare: no disturbance explains it.
        """
        told: list[str] = []
        outcome = in_peace(trial.name, lambda: self._moved_again(trial), told=told)
        return msgspec.structs.replace(outcome, begun_anew=tuple(told))

    def _moved_again(self, trial: Trial) -> Outcome:
        try:
            outcome = self._try(trial)
        except RobotError as error:
            raise DisturbedError(f"the arm was not taken: {error}") from error
        if outcome.again is not None:
            raise DisturbedError(f"did not move again: {outcome.again.what}")
        return outcome

    def _try(self, trial: Trial) -> Outcome:
        trace = Path(self._folder.name) / "trace"
        with ExitStack() as stack:
            try:
                stack.enter_context(ControllerProcess(Setup(host=self._host, trace=str(trace))))
            except ControllerProcessError as error:
                raise DisturbedError(str(error)) from error
            rider = stack.enter_context(Rider(self._host))
            witness = None if trial.shows is None else stack.enter_context(Witness(self._host, trace))
            stage = Stage(host=self._host, rider=rider, pendant=Pendant(self._host))
            return _Run(trial, stage, Motion(trace), witness).run()


class _Run:
    """One fault, start to end."""

    def __init__(self, trial: Trial, stage: Stage, motion: Motion, witness: Witness | None) -> None:
        self._trial, self._stage, self._motion, self._witness = trial, stage, motion, witness
        self._proof: Proof | None = None

    def run(self) -> Outcome:
        trial, stage, rider = self._trial, self._stage, self._stage.rider
        happened_s, raised = self._happen()
        if raised is not None and raised.at_s < happened_s - 1e-3:
            raise DisturbedError(f"before {trial.name}: {raised}")
        if raised is not None and not trial.is_stop:
            raise DisturbedError(f"{trial.name} was not borne: {raised}")
        if trial.is_stop:
            sleep(trial.hold_s)
            held = self._held()
        else:
            rider.client.close()
            sleep(SETTLE_S)
            held = None
        jogged, until_s = self._jog()
        barred = self._bar() if trial.bars else None
        ended_s = monotonic()
        trial.end(stage)
        stop = self._judge_stop(happened_s, until_s or monotonic())
        sleep(AFTER_S)
        restored = self._motion.moved_rad(ended_s if until_s else self._rest_s, monotonic()) if trial.is_stop else None
        trial.person(stage)
        taken_s = monotonic()
        rider.take()
        rearm = self._motion.moved_rad(taken_s, monotonic())
        again = rider.ride(0.4)
        return Outcome(
            trial=trial,
            raised=raised,
            told_s=None if raised is None else raised.at_s - happened_s,
            proof=self._proof,
            stop=stop,
            barred=barred,
            held=held,
            jogged_rad=jogged,
            restored_rad=restored,
            rearm_rad=rearm,
            again=again,
        )

    def _happen(self) -> tuple[float, Raised | None]:
        """Let the fault happen at its moment; return when it did, and what came up."""
        trial, stage, rider = self._trial, self._stage, self._stage.rider

        def begin() -> float:
            if self._witness is None or trial.shows is None:
                return trial.begin(stage)
            return self._watched(trial.shows, self._witness)

        match trial.during:
            case Moment.ENGAGE:
                return rider.engage_into(begin, after_s=trial.after_s)
            case Moment.SEED:
                return rider.seed_into(begin)
            case Moment.STOP:
                rider.take()
                return rider.stop_into(begin)
            case Moment.RIDE:
                rider.take()
                return rider.ride_into(begin, wait_s=NEVER_S if trial.is_stop else BORNE_S)

    def _watched(self, shows: Shows, witness: Witness) -> float:
        """Let the fault happen and last before the eyes of a second client, and return when it did."""
        stage = self._stage
        facts, before = read_facts(stage.host), witness.look(BEFORE_S)
        stage.answers.clear()
        happened_s = self._trial.begin(stage)
        during = witness.look(DURING_S)
        sight = Sight(before=before, during=during, facts=(facts, read_facts(stage.host)), rows=_rows_in(stage.answers))
        self._proof = shows(sight)
        return happened_s

    def _jog(self) -> tuple[float | None, float | None]:
        """Return how far somebody moved a joint, and when he began."""
        if not self._trial.is_jogged:
            return None, None
        began_s = monotonic()
        self._stage.fault("jog", rad=[-JOG_RAD, 0.0, 0.0, 0.0, 0.0, 0.0])
        sleep(1.6)
        return self._motion.moved_rad(began_s, monotonic()), began_s

    def _held(self) -> str | None:
        """Return who still holds an arm that was lost outside a time step, or not seen to stop, where nobody may."""
        is_riding = self._trial.during is Moment.RIDE
        if is_riding and not self._trial.ends_process:
            return None
        pid, runtime = self._stage.rider.client.pid, ask_fault(self._stage.host, "truth")["runtime"]
        if pid is not None and not is_ended(pid):
            return f"process {pid}"
        return None if is_riding or runtime == "STOPPED" else f"a program: {runtime}"

    def _bar(self) -> str | None:
        """Try to take the arm while nobody may."""
        try:
            self._stage.rider.take()
        except RobotError as error:
            return f"{type(error).__name__}: {error}"
        return None

    def _judge_stop(self, happened_s: float, until_s: float) -> Judged | None:
        """Wait for rest, where physics still had to go on for it, and judge the stop."""
        self._rest_s = until_s
        if not self._trial.is_stop:
            return None
        judged = self._motion.judge(happened_s, until_s, begins_s=self._trial.begins_s)
        end_s = monotonic() + REST_LIMIT_S
        while judged.after_rad == float("inf") and monotonic() < end_s:
            sleep(0.1)
            self._rest_s = monotonic()
            judged = self._motion.judge(happened_s, self._rest_s, begins_s=self._trial.begins_s)
        return judged


def _rows_in(answers: dict[str, dict[str, object]]) -> tuple[tuple[float, float, float, float], ...]:
    """Return what a calibration told that it added to the arm's rows; nothing where there was none."""
    told = answers.get("calibrate", {}).get("rows", [])
    return msgspec.convert(told, tuple[tuple[float, float, float, float], ...])
