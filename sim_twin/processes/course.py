"""One case after the other against what moves an arm: a commander, its servo process, the bus, a controller."""

from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep
from types import TracebackType
from typing import Self

import msgspec
import numpy as np

from robot.kinematics import ToolChain
from robot.messages import StationMode
from sim_twin.broken.judge import Motion
from sim_twin.broken.tries import DisturbedError, in_peace
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from sim_twin.paired.ride import BUS_PORT, wired_rig
from sim_twin.processes.cases import Case, Stage, besiege
from sim_twin.processes.commander import CommanderError, CommanderProcess, Order
from sim_twin.processes.judge import judge_ramp
from sim_twin.processes.outcome import Outcome
from sim_twin.processes.relay import Relay

__all__ = ["ProcessCourse"]

RELAY_PORT = BUS_PORT + 1
N_WARM, WAY_S, LOOK_S = 12, 8.0, 0.002
SETTLE_S, AGAIN_S, ARM_S = 0.4, 3.0, 12.0
BEFORE_S = 0.15
LATE_S, GAP_S = 0.09, 0.02
"""A commander that was kept from asking for so long before anything happened, or physics that stood still for so long,
were disturbed by this machine."""
AGAIN_STEPS = 5


class ProcessCourse:
    """A virtual controller, its bus through a relay, and commanders; a commander lives on where a case lets it.

    Args:
        host: a loopback address that is free.
    """

    def __init__(self, host: str) -> None:
        wired = wired_rig(host)
        rig = msgspec.structs.replace(wired.rig, bus=f"tcp/{host}:{RELAY_PORT}")
        self._host, self._resolved = host, msgspec.structs.replace(wired, rig=rig)
        self._endpoint = f"tcp/{host}:{BUS_PORT}"
        self._chain = ToolChain(wired.arm)
        self._open = ExitStack()
        self._commander: CommanderProcess | None = None

    def __enter__(self) -> Self:
        """Start controller and bus."""
        with ExitStack() as opening:
            folder = Path(opening.enter_context(TemporaryDirectory(prefix="autotelic-processes-")))
            cell = self._resolved.rig.cell
            assert cell is not None, "virtual_lab names one"
            setup = Setup(host=self._host, cell=cell, bus=self._endpoint, trace=str(folder / "trace"))
            opening.enter_context(ControllerProcess(setup))
            self._relay = opening.enter_context(Relay((self._host, RELAY_PORT), (self._host, BUS_PORT)))
            self._motion = Motion(folder / "trace")
            opening.callback(self._dismiss)
            self._open = opening.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def run(self, case: Case) -> Outcome:
        """Put the processes through one case; begin anew where this machine disturbed it.

        Raises:
            DisturbedError: it did so each time, and this machine was busy elsewhere.
            CutShortError: it did so each time on a machine that had time to spare.
        """
        told: list[str] = []
        outcome = in_peace(case.name, lambda: self._try(case), told=told)
        return msgspec.structs.replace(outcome, begun_anew=tuple(told))

    def _try(self, case: Case) -> Outcome:
        try:
            return self._run(case, self._stage())
        except (CommanderError, DisturbedError) as error:
            self._dismiss()
            self._relay.mend()
            raise DisturbedError(str(error)) from error

    def _run(self, case: Case, stage: Stage) -> Outcome:
        self._get_under_way(stage)
        began_s = case.begin(stage)
        log = stage.commander.log
        if case.is_sudden and log.failed_s is not None and log.failed_s < began_s:
            raise DisturbedError(f"before {case.name} the station was refused {began_s - log.failed_s:.3f} s")
        sleep(case.hold_s)
        last_s = log.last_s(began_s if case.is_sudden else monotonic())
        if last_s is None or (case.is_sudden and began_s - last_s > LATE_S):
            raise DisturbedError(f"before {case.name} the commander was late")
        case.end(stage)
        sleep(SETTLE_S)
        besiege(stage)
        if case.is_deadly:
            self._dismiss()
            stage = self._stage()
        state = stage.commander.tell(Order.STATE)
        sleep(SETTLE_S)
        n_refused = stage.commander.log.n_refused
        t_s, q, qd = self._motion.rows(last_s - BEFORE_S, monotonic())
        self._require_physics(t_s, last_s)
        ramp = judge_ramp(t_s, q, qd, last_s=last_s, chain=self._chain, stopping=self._resolved.profile.stopping)
        self._move_again(stage)
        return Outcome(
            case=case,
            stopping=self._resolved.profile.stopping,
            ramp=ramp,
            event_s=began_s - last_s,
            mode=state.mode,
            reason=state.reason,
            n_refused=n_refused,
        )

    def _stage(self) -> Stage:
        if self._commander is None:
            self._commander = CommanderProcess(self._resolved).__enter__()
        return Stage(
            commander=self._commander,
            relay=self._relay,
            endpoint=self._endpoint,
            serial=self._resolved.rig.expected.serial,
        )

    def _dismiss(self) -> None:
        commander, self._commander = self._commander, None
        if commander is not None:
            commander.close()

    def _get_under_way(self, stage: Stage) -> None:
        """Have it armed, unless it is, and wait until the arm is at full speed and far from turning."""
        if stage.commander.tell(Order.STATE).mode is not StationMode.ENGAGED:
            self._arm(stage)
        log, end_s = stage.commander.log, monotonic() + WAY_S
        while not (log.is_midway and log.n_good >= N_WARM):
            if log.failed_s is not None or monotonic() > end_s:
                raise DisturbedError(f"before anything went wrong: {stage.commander.tell(Order.STATE).reason}")
            sleep(LOOK_S)

    def _arm(self, stage: Stage) -> None:
        """Let a person arm it; a bus that was cut may take its time to be there again."""
        end_s = monotonic() + ARM_S
        while True:
            try:
                stage.commander.tell(Order.ARM)
            except CommanderError:
                if monotonic() > end_s or not stage.commander.is_alive:
                    raise
            else:
                return

    def _move_again(self, stage: Stage) -> None:
        """Let a person arm it, and see that it moves; a case that ends otherwise is begun anew."""
        self._arm(stage)
        log, end_s = stage.commander.log, monotonic() + AGAIN_S
        while log.n_good < AGAIN_STEPS:
            if log.failed_s is not None or monotonic() > end_s:
                raise DisturbedError(f"did not move again: {stage.commander.tell(Order.STATE).reason}")
            sleep(LOOK_S)

    def _require_physics(self, t_s: np.ndarray, last_s: float) -> None:
        """Raise DisturbedError where physics itself stood still while it mattered."""
        mattered = t_s[t_s < last_s + 1.0]
        if len(mattered) < 2 or float(np.diff(mattered).max()) > GAP_S:
            raise DisturbedError("the physics stood still")
