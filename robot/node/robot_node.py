"""The robot node: holds one station and serves it over the bus, to one source at a time. State and edge.

Time steps come as intents and go back as results; all else are questions. Stops are looked at before everything else,
and reach a process that holds the arm at once, past this loop.
"""

import secrets
from collections import deque
from collections.abc import Callable
from time import monotonic_ns
from typing import TypeVar

import msgspec

from robot.bus.errors import BusError
from robot.bus.ports import Publisher
from robot.bus.queries import Asked
from robot.bus.session import Bus
from robot.bus.station_rows import (
    Arm,
    ArmableWork,
    ClearLatch,
    Command,
    Describe,
    Engage,
    Failed,
    HandOver,
    LayOut,
    Release,
    ResetPlant,
    StationAsk,
    StationCard,
    StationReport,
    StationTold,
    StepDone,
    StopAsk,
    TakeLease,
)
from robot.bus.topics import ARM_STATE, ASK, INTENT, LAY_OUT, PERCEPT, REPORT, REQUESTED, SENT, STEP, VERDICT
from robot.errors import NotEngagedError, RobotError, SafetyError
from robot.messages import ArmState, Percept, StepResult
from robot.node.admission import Admission
from robot.node.errand import AtTheArm, Errand, failed_by, is_errand, is_his
from robot.node.inbox import Inbox, Refused
from robot.node.pulse import Pulse
from robot.node.served import ServedStation
from robot.tick_notes import TickNote

__all__ = ["RobotNode"]

LOOK_S, REPORT_NS, MEASURE_NS = 0.01, 100_000_000, 100_000_000
FAILED_NS, MOST_FAILED_NS = 1_000_000_000, 8_000_000_000
N_REASONS, N_STOPS = 16, 16
HANDED_LIFE_NS = 10_000_000_000
"""How long a lease that was handed over waits for its source."""
T = TypeVar("T", bound=msgspec.Struct)
_Question = Asked[StationAsk, StationTold]


class RobotNode:
    """Serves a station until it is closed.

    Args:
        bus: open; this process is a robot there.
        station: disarmed. The node connects to it, and arms nothing by itself.
        scenario: the table's name.
        profile: of the limits.
        drive: has the station's hand do what it is asked (True), or decide by itself (False).
        halt: told of a stop at once, on the bus's thread, for an arm that is held in another process.
        end_halt: told once every stop was carried out.
        take_notes: returns what ticks of the last time step asked for, thinned.
        is_perceiving: percepts are this process's own, and told by it.
        say: tells a person at this process's terminal.
        is_attended: what is asked for may take as long as a person at the arm needs for it.
        person: arms this arm, and nobody else does; None where whoever has the lease may, for nothing can be hurt.
        now_ns: this process's monotonic clock.

    Attributes:
        pulse: how its loop goes.
    """

    def __init__(
        self, bus: Bus, station: ServedStation, *, scenario: str, profile: str,
        drive: Callable[[bool], object] = lambda _: None, halt: Callable[[], object] = lambda: None,
        end_halt: Callable[[], object] = lambda: None, take_notes: Callable[[], tuple[TickNote, ...]] = tuple,
        is_perceiving: bool = True, say: Callable[[str], object] = lambda _: None, is_attended: bool = False,
        person: AtTheArm | None = None, now_ns: Callable[[], int] = monotonic_ns,
    ) -> None:  # fmt: skip
        self._station, self._scenario, self._profile = station, scenario, profile
        self._drive, self._take_notes, self._now_ns = drive, take_notes, now_ns
        self._say, self._is_attended, self._person, self._errand = say, is_attended, person, Errand()
        self._is_over: Callable[[], bool] = lambda: False
        self.pulse = Pulse(now_ns=now_ns)
        assert INTENT.deadline_s is not None, "an intent grows old"
        self._admission = Admission(max_age_ns=round(INTENT.deadline_s * 1e9), now_ns=now_ns)
        self._inbox = Inbox(bus, self._admission, halt=halt)
        self._halt, self._end_halt = halt, end_halt
        self._answerers = bus.answerer(ASK), bus.answerer(LAY_OUT)
        self._steps, self._reports = bus.publisher(STEP), bus.publisher(REPORT)
        self._states, self._percepts = bus.publisher(ARM_STATE), bus.publisher(PERCEPT) if is_perceiving else None
        self._told_ns: int | None = None
        """Stamp of the measurement that was told last."""
        self._verdicts, self._sent = bus.publisher(VERDICT), bus.publisher(SENT)
        self._requested = bus.publisher(REQUESTED)
        self._begun, self._revision = secrets.randbits(48), 0
        self._stops: deque[int] = deque(maxlen=N_STOPS)
        self._is_final = False
        self._last_step: StepDone | None = None
        """The answer that is given again where it seems to be lost."""
        self._reported: tuple[object, ...] | None = None
        self._report_ns = self._measure_ns = 0
        self._pause_ns = MEASURE_NS

    def run(self, is_over: Callable[[], bool]) -> None:
        """Serve until told that it is over; the arm is stopped and let go of then."""
        self._is_over = is_over
        try:
            while not is_over():
                self._inbox.wait(LOOK_S)
                self.turn()
        finally:
            self.close()

    def turn(self) -> None:
        """Do what has come."""
        self.pulse.beat()
        self.pulse.queue = self._inbox.n_waiting
        self._carry_out_stops()
        if self._inbox.has_beat():
            self._station.renew_lease()
        for answerer in self._answerers:
            asked = answerer.next()
            if asked is not None:
                self._answer(asked)
                self._carry_out_stops()
        if self._inbox.is_repeated() and self._last_step is not None:
            self._put(self._steps, self._last_step)
        command = self._inbox.command()
        if command is not None:
            self._step(command)
            self._carry_out_stops()
        refused = self._inbox.refused()
        if refused is not None:
            self._say_refused(refused)
        self._look()

    def tend(self) -> None:
        """See to what cannot wait while a person at the arm is waited for, or the arm is on its way to and from him.

        Raises:
            SafetyError: what he is waited for is void: somebody said stop, or this node ends.
            NotEngagedError: who asked has gone.
        """
        self.pulse.beat()
        if self._carry_out_stops():
            raise SafetyError("somebody said stop: what a person at the arm was asked for is void")
        if self._inbox.has_beat():
            self._station.keep_lease()
        for answerer in self._answerers:
            asked = answerer.next()
            if asked is not None:
                asked.answer(self._meanwhile(asked.request))
        self._tell_report(is_due=self._now_ns() - self._report_ns >= REPORT_NS)
        if self._is_over():
            raise SafetyError("this robot node ends: what a person at the arm was asked for is void")
        if not self._station.lease_number:
            raise NotEngagedError("who asked a person at the arm for it has gone: it is void")

    @property
    def is_stop_due(self) -> bool:
        """Whether somebody said stop and it waits to be confirmed."""
        return self._inbox.has_stop

    def close(self) -> None:
        """Stop the arm and let go of it. Idempotent."""
        try:
            self._station.stop(by="its robot node, which ends")
            self._tell_report(is_due=True)
        except RobotError as error:
            self.pulse.fail(str(error))
        self._inbox.close()
        self._station.close()

    # ---------------------------------------------------------------------------------------------------------- stop

    def _carry_out_stops(self) -> bool:
        """Stop, as often as it was said, and return whether it was."""
        asked = self._inbox.stop()
        is_any = asked is not None
        while asked is not None:
            self._stop(asked)
            asked = self._inbox.stop()
        if is_any:
            self._end_halt()
            if self._inbox.has_stop:  # it came just now: whatever is begun next must still find it
                self._halt()
        return is_any

    def _stop(self, asked: StopAsk) -> None:
        if asked.number in self._stops:
            return
        self._is_final |= asked.is_final
        try:
            self._station.stop(by=asked.by)
        except RobotError as error:
            self.pulse.fail(f"stop: {error}")
            return
        self._stops.append(asked.number)
        self._tell_report(is_due=True)

    # --------------------------------------------------------------------------------------------------------- steps

    def _step(self, command: Command) -> None:
        try:
            result = self._station.step(command.intent, duration_s=command.duration_s)  # pyright: ignore[reportArgumentType] - the gate refuses what is no intent
        except RobotError as error:
            self._publish_step(command, failed=failed_by(error))
            return
        measured = self._station.measured
        self._publish_step(command, result=result, measured=measured)
        self._publish_parts(result, measured)

    def _publish_step(
        self, command: Command, *, result: StepResult | None = None, measured: ArmState | None = None,
        failed: Failed | None = None,
    ) -> None:  # fmt: skip
        done = StepDone(
            lease=command.lease, number=command.number, report=self._report(), result=result, measured=measured,
            failed=failed,
        )  # fmt: skip
        self._last_step = done
        self._put(self._steps, done)

    def _publish_parts(self, result: StepResult, measured: ArmState) -> None:
        """Tell whoever watches what came of a time step, one topic each."""
        if measured.stamp_ns != self._told_ns:
            self.tell_measured(measured)
        self._tell_percept(result.percept)
        notes = self._take_notes()
        for note in notes:
            self._put(self._requested, note.requested)
            if note.is_sent:
                self._put(self._sent, note.requested)
                self._put(self._verdicts, note.verdict)  # what was refused is among the time step's verdicts
        if not notes and result.executed.sent is not None:
            self._put(self._sent, result.executed.sent)
        for verdict in result.verdicts:
            self._put(self._verdicts, verdict)

    def _say_refused(self, refused: Refused) -> None:
        self.pulse.fail(refused.why)
        command, failed = refused.command, Failed(kind=NotEngagedError.__name__, message=refused.why)
        self._put(
            self._steps,
            StepDone(lease=command.lease, number=command.number, report=self._report(), failed=failed),
        )

    # ----------------------------------------------------------------------------------------------------- questions

    def _answer(self, asked: _Question) -> None:
        request = asked.request
        if self._errand.is_this(request):
            asked.answer(self._errand.told(self._report()))
        elif self._is_attended and is_errand(request) and self._has_turn(request):
            self._errand.begin(request)
            asked.answer(self._errand.told(self._report()))
            self.pulse.doing = f"waits for a person at the arm: {self._errand.what}"
            told = self._outcome(request)
            self._errand.end(told)
            if told.failed is not None:
                self._say(f"that is void now: {told.failed.message}")
        else:
            asked.answer(self._outcome(request))

    def _meanwhile(self, request: StationAsk) -> StationTold:
        """Return what a question comes to while a person is waited for."""
        if self._errand.is_this(request):
            return self._errand.told(self._report())
        if isinstance(request.work, Describe | Release):
            return self._outcome(request)
        busy = SafetyError(f"robot node: it waits for a person at the arm ({self._errand.what}); ask again after that")
        return StationTold(report=self._report(), failed=failed_by(busy))

    def _has_turn(self, request: StationAsk) -> bool:
        return self._admission.why_no_turn(request.lease, request.number) is None

    def _outcome(self, request: StationAsk) -> StationTold:
        try:
            return self._obey(request)
        except RobotError as error:
            self.pulse.fail(f"{type(request.work).__name__}: {error}")
            return StationTold(report=self._report(), failed=failed_by(error))

    def _obey(self, request: StationAsk) -> StationTold:
        work = request.work
        if isinstance(work, Describe):
            return StationTold(report=self._report(), card=self._card())
        if isinstance(work, TakeLease):
            return self._take_lease(work)
        why = self._admission.why_no_turn(request.lease, request.number)
        if why is not None:
            raise NotEngagedError(self._admission.refuse(why))
        self._admission.use(request.number)
        return self._do(work)

    def _do(self, work: ArmableWork) -> StationTold:
        station, percept = self._station, None
        if self._is_final and isinstance(work, Arm | Engage | ClearLatch):
            raise SafetyError("to arm it: whoever started this robot node is ending it; start it again")
        if self._person is not None and is_his(work, station, self._person):
            return StationTold(report=self._report())
        match work:
            case Arm(by=by):
                station.arm(by=by)
            case Engage():
                station.engage()
                return StationTold(report=self._report(), measured=station.measured, percept=station.percept)
            case ResetPlant(seed=seed, epoch=epoch):
                station.reset_plant(seed=seed, epoch=epoch)
            case ClearLatch(by=by):
                station.clear_latch(by=by)
            case LayOut(seed=seed, epoch=epoch):
                percept = station.reset(seed=seed, epoch=epoch)
                self._tell_percept(percept)
                return StationTold(report=self._report(), percept=percept, measured=station.measured)
            case HandOver(to=to):
                station.hand_over(to, life_ns=HANDED_LIFE_NS)
                self._inbox.begin("")
            case Release():
                station.let_go()
                self._inbox.begin("")
        return StationTold(report=self._report(), percept=percept)

    def _take_lease(self, work: TakeLease) -> StationTold:
        self._station.take_lease(work.source, life_ns=round(work.life_s * 1e9))
        self._drive(work.is_driven)
        lease = secrets.token_hex(8)
        self._inbox.begin(lease)
        return StationTold(report=self._report(), lease=lease)

    def _card(self) -> StationCard:
        station = self._station
        return StationCard(
            spec=station.spec, identity=station.identity, scenario=self._scenario, profile=self._profile,
            model_sha256=station.model_sha256,
        )  # fmt: skip

    # ------------------------------------------------------------------------------------------------------- telling

    def _look(self) -> None:
        """Tell how the station is, ten times a second and whenever that has changed; and what an idle arm measures."""
        now_ns = self._now_ns()
        state = self._station.state
        self.pulse.doing = f"{state.mode}{' for ' + state.source if state.source else ''}"
        self._tell_report(is_due=now_ns - self._report_ns >= REPORT_NS)
        if not self._station.lease_number and now_ns - self._measure_ns >= self._pause_ns:
            self._measure(now_ns)

    def tell_measured(self, state: ArmState) -> None:
        """Tell a measurement: whoever perceives answers it."""
        self._told_ns = state.stamp_ns
        self._put(self._states, state)

    def _tell_percept(self, percept: Percept) -> None:
        if self._percepts is not None:
            self._put(self._percepts, percept)

    def _measure(self, now_ns: int) -> None:
        """Read an arm that nobody commands; one that cannot be read is tried again with growing pauses."""
        self._measure_ns = now_ns
        try:
            self.tell_measured(self._station.measure())
            self._pause_ns = MEASURE_NS
        except RobotError as error:
            self.pulse.fail(str(error))
            self._pause_ns = min(MOST_FAILED_NS, max(FAILED_NS, 2 * self._pause_ns))
            self._measure_ns = self._now_ns()

    def _tell_report(self, *, is_due: bool) -> None:
        station = self._station
        now = (station.state, station.lease_number, station.n_latches, len(self._stops))
        if is_due or now != self._reported:
            self._reported, self._report_ns = now, self._now_ns()
            self._put(self._reports, self._report())

    def _report(self) -> StationReport:
        self._revision += 1
        station, admission = self._station, self._admission
        return StationReport(
            revision=self._revision, begun=self._begun, state=station.state, holder=station.lease_number,
            n_latches=station.n_latches, latch_reasons=station.latch_reasons[-N_REASONS:], stops=tuple(self._stops),
            n_refused=admission.n_refused, refused=admission.refused,
        )  # fmt: skip

    def _put(self, publisher: Publisher[T], message: T) -> None:
        try:
            publisher.put(message)
        except BusError as error:
            self.pulse.fail(str(error))
