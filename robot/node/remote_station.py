"""A station over the bus: what a learner or a teleoperator holds of a robot node, with the same door as at home.

Nothing is taken for granted that the robot node did not say. A time step that it does not answer is void: the arm has
come to rest by then, for nobody told it to go on.
"""

import secrets
from collections.abc import Callable
from contextlib import suppress
from threading import Condition, Event, Thread
from time import monotonic_ns
from types import TracebackType
from typing import Any, Self

import msgspec

from robot.as_came import AsCame, as_came
from robot.bus.account_rows import AccountPart
from robot.bus.errors import BusError
from robot.bus.inlet import Received
from robot.bus.ports import Subscriber
from robot.bus.session import Bus
from robot.bus.station_rows import (
    Arm,
    Beat,
    ClearLatch,
    Command,
    Describe,
    Engage,
    LayOut,
    Release,
    ResetPlant,
    StationCard,
    StationReport,
    StationTold,
    StepDone,
    TakeLease,
    Work,
)
from robot.bus.topics import ACCOUNT, ARM_STATE, BEAT, INTENT, REPORT, STEP, WRITTEN
from robot.errors import NotEngagedError, RobotConfigError, RobotError, SafetyError
from robot.messages import (
    ArmState,
    Executed,
    Intent,
    Outcome,
    Percept,
    PlantIdentity,
    StationSpec,
    StationState,
    StepResult,
    Verdict,
)
from robot.node.asking import AnsweredError, NodeAsker, error_of
from robot.node.known import Known
from robot.node.pulse import HealthTeller, Pulse
from robot.node.stop_caller import StopCaller
from robot.recording.account import Account
from robot.safety import Answer, Reason

__all__ = ["RemoteStation"]

BEAT_S, LIFE_S = 0.2, 2.0
ANSWER_S = 2.0
"""How much longer than it lasts a time step may take to be answered."""
AGAIN_S = 0.03
"""A command is sent again after so long without an answer."""
STOP_S = 5.0
AT_HOME = "a real arm is armed in the process that holds it: what its cell shows is answered there, no bus carries it"


class RemoteStation:
    """Implements robot.station.Station, and Armable for an operator where no hardware is attached.

    Args:
        bus: open; closed with the station.
        asker: asks the robot node.
        is_driven: a person drives: the hand does what it is asked and nothing by itself.
        now_ns: this process's monotonic clock.
    """

    def __init__(
        self, bus: Bus, *, asker: NodeAsker, is_driven: bool = False, now_ns: Callable[[], int] = monotonic_ns
    ) -> None:
        self._now_ns = now_ns
        self._bus, self._asker, self._is_driven = bus, asker, is_driven
        self._source = f"{bus.source}:{secrets.token_hex(2)}"
        self._life_s = LIFE_S
        self._known, self._came = Known(now_ns=now_ns), Condition()
        self._done: StepDone | None = None
        self._lease, self._holder, self._number = "", 0, 0
        self._was_engaged = self._is_closed = False
        self._card: StationCard | None = None
        self._percept: Percept | None = None
        self._measured: ArmState | None = None
        self._intents, self._beats = bus.publisher(INTENT), bus.publisher(BEAT)
        self._open: tuple[Subscriber[Any], ...] = (
            bus.subscriber(STEP, self._take_step), bus.subscriber(REPORT, self._take_report),
            bus.subscriber(ARM_STATE, self._take_state),
        )  # fmt: skip
        self._pulse = Pulse(now_ns=now_ns)
        self._health = HealthTeller(bus, self._pulse)
        self._is_over = Event()
        self._heart: Thread | None = None

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # --------------------------------------------------------------------------------------------- what is known of it

    @property
    def spec(self) -> StationSpec:
        """What may be known before the first step."""
        return self._described().spec

    @property
    def identity(self) -> PlantIdentity:
        """Which world the robot node found."""
        return self._described().identity

    @property
    def model_sha256(self) -> str | None:
        """Digest of the world's model, where it is a simulated one there."""
        return self._described().model_sha256

    @property
    def state(self) -> StationState:
        """Mode and reason, as the robot node tells them; disarmed where another has the lease, or nothing is heard."""
        return self._known.state(self._holder)

    @property
    def n_latches(self) -> int:
        """How often the station has latched since this one joined."""
        return self._known.n_latches

    @property
    def latch_reasons(self) -> tuple[str, ...]:
        """Why it has latched since then, oldest first."""
        return self._known.latch_reasons

    @property
    def measured(self) -> ArmState:
        """What the arm measured last."""
        if self._measured is None:
            raise NotEngagedError("expected a station that was engaged, nothing was measured yet")
        return self._measured

    @property
    def percept(self) -> Percept:
        """What was perceived last."""
        if self._percept is None:
            raise NotEngagedError("expected a station that was engaged, nothing was perceived yet")
        return self._percept

    def connect(self) -> None:
        """Ask what station there is. Moves nothing. Idempotent.

        Raises:
            BusError: no robot node answers.
        """
        self._described()

    def expect(self, *, scenario: str, profile: str) -> None:
        """Check that the robot node has the table and holds the limits that are meant.

        Raises:
            RobotConfigError: it does not.
            BusError: it does not answer.
        """
        card = self._described()
        if (card.scenario, card.profile) != (scenario, profile):
            raise RobotConfigError(
                f"robot node: expected scenario {scenario} and profile {profile}, it has {card.scenario} and "
                f"{card.profile}: start it with the same (`autotelic up RIG --scenario ...`)"
            )

    # ---------------------------------------------------------------------------------------------- lease and arming

    def take_lease(self, source: str, *, life_ns: int | None = None) -> None:
        """Take the lease under a name; without a word of this process for longer than its life it ends.

        Raises:
            SafetyError: another source has it.
        """
        self._source = f"{source}:{secrets.token_hex(2)}"
        if life_ns is not None:
            self._life_s = life_ns / 1e9
        self._take_lease()

    def stop(self, *, by: str) -> None:
        """Stop the arm, whoever has the lease, and return when that is confirmed.

        Raises:
            SafetyError: nobody confirms it.
        """
        caller = StopCaller(self._bus, by=by)
        took_s = caller.stop(within_s=STOP_S)
        caller.close()
        if took_s is None or caller.report is None:
            raise SafetyError(
                f"stop: expected a robot node to confirm it within {STOP_S:g} s, none did: look at the arm"
            )
        with self._came:
            self._known.take(caller.report)  # this station's own subscription may hear it later

    def challenge(self) -> str | None:
        """Refuse: no bus carries answers. Raises SafetyError."""
        raise SafetyError(AT_HOME)

    @property
    def has_button(self) -> bool:
        """No: a button at the cell is looked at by the process that holds the arm."""
        return False

    def pressed(self) -> Answer | None:
        """Refuse, as `challenge`. Raises SafetyError."""
        raise SafetyError(AT_HOME)

    def arm(self, *, by: str, answer: Answer | None = None) -> None:
        """Go from disarmed to armed; the lease is taken where it is not ours. For an operator."""
        if answer is not None:
            raise SafetyError(AT_HOME)
        self._leased(Arm(by=by))

    def engage(self) -> None:
        """Go from armed to engaged. For an operator."""
        self._taken(self._asked(Engage()))

    def reset_plant(self, *, seed: int, epoch: int) -> None:
        """Lay the table out in any mode. Clears no latch. For an operator."""
        self._leased(ResetPlant(seed=seed, epoch=epoch))

    def clear_latch(self, *, by: str, answer: Answer | None = None) -> None:
        """Go from latched to armed, after the plant's reset only. For an operator."""
        if answer is not None:
            raise SafetyError(AT_HOME)
        self._leased(ClearLatch(by=by))

    # ------------------------------------------------------------------------------------------------------- commands

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Lay the table out for an epoch and return the first percept.

        Raises:
            NotEngagedError: it is not engaged for this one.
            RobotError: the table was not laid out, or the robot node does not answer.
        """
        self._was_engaged = False
        if not self._lease:
            raise NotEngagedError(f"expected an engaged station, it is {self.state.mode}; an operator must arm it")
        told = self._taken(self._asked(LayOut(seed=seed, epoch=epoch)))
        assert told.percept is not None, "a reset tells it"
        return told.percept

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        """Carry out an intent for one time step and return the percept after it.

        Raises:
            NotEngagedError: it is not engaged for this one, and that was known before.
            RobotConfigError: the duration is not a whole number of ticks from one up.
        """
        if not self._was_engaged:
            state = self.state
            why = f" ({state.reason})" if state.reason else ""
            raise NotEngagedError(f"expected an engaged station, it is {state.mode}{why}; an operator must arm it")
        duration = self.spec.step_s if duration_s is None else duration_s
        self._number += 1
        number = self._number
        crossing = _crossing(intent)
        command = Command(lease=self._lease, number=number, intent=crossing, duration_s=duration_s)
        try:
            done = self._answer_to(command, within_s=_finite(duration) + ANSWER_S)
        except BusError as error:
            return self._void(crossing, str(error))
        if done is None:
            return self._void(crossing, f"expected an answer of the robot node within {ANSWER_S:g} s, none came")
        return self._result(done, intent, crossing)

    def open_account(self) -> Account:
        """Return a way to tell a recorder on the bus what is learnt from; nothing waits for one."""
        told = self._bus.publisher(ACCOUNT)

        def put(part: AccountPart) -> None:
            with suppress(BusError):
                told.put(part)

        account = Account(secrets.randbits(48), put=put, now_ns=self._now_ns)
        self._open = (*self._open, self._bus.subscriber(WRITTEN, lambda received: account.take(received.message)))
        return account

    def close(self) -> None:
        """Let go of the lease and leave the bus: the arm is stopped and disarmed. Idempotent, never raises."""
        if self._is_closed:
            return
        self._is_closed = True
        self._was_engaged = False
        self._is_over.set()
        if self._heart is not None:
            self._heart.join()
        self._health.close()
        if self._lease and not self._known.is_silent:
            with suppress(RobotError, AnsweredError):
                self._number += 1
                self._asker.ask(Release(), lease=self._lease, number=self._number)
        self._lease, self._holder = "", 0
        for subscriber in self._open:
            subscriber.close()
        self._bus.close()

    # --------------------------------------------------------------------------------------------------------- inside

    def _described(self) -> StationCard:
        if self._card is None:
            told = self._ask(Describe())
            assert told.card is not None, "a description tells it"
            self._card = told.card
        return self._card

    def _take_lease(self) -> None:
        self.connect()
        told = self._ask(TakeLease(source=self._source, life_s=self._life_s, is_driven=self._is_driven))
        self._lease, self._holder, self._number = told.lease, told.report.holder, 0
        self._was_engaged = False
        if self._heart is None:
            self._heart = Thread(target=self._beat, name="lease", daemon=True)
            self._heart.start()

    def _leased(self, work: Work) -> StationTold:
        """Ask for something under the lease in force, which is taken where it is not ours (any more)."""
        self._was_engaged = False
        report = self._known.report
        if not self._lease or self._known.is_silent or report is None or report.holder != self._holder:
            self._take_lease()
        return self._asked(work)

    def _asked(self, work: Work) -> StationTold:
        self._number += 1
        return self._ask(work, lease=self._lease, number=self._number)

    def _ask(self, work: Work, *, lease: str = "", number: int = 0) -> StationTold:
        try:
            told = self._asker.ask(work, lease=lease, number=number)
        except AnsweredError as answered:
            self._known.take(answered.told.report)
            raise answered.error from answered
        self._known.take(told.report)
        return told

    def _taken(self, told: StationTold) -> StationTold:
        """Note that the station is engaged for this one, and what was measured then."""
        self._was_engaged = True
        self._percept, self._measured = told.percept, told.measured
        return told

    def _answer_to(self, command: Command, *, within_s: float) -> StepDone | None:
        """Ask for a time step until it is answered; None where it is not in time.

        A link that is full drops messages, the command or its answer. It is the same command each time, stamped when
        it was made: the robot node carries it out once, or not at all once it has grown old.
        """
        made_ns = self._now_ns()
        end_ns = made_ns + round(within_s * 1e9)
        while self._now_ns() < end_ns:
            self._intents.put(command, stamp_ns=made_ns)
            with self._came:
                if self._came.wait_for(lambda: self._is_answered(command.number), AGAIN_S):
                    return self._done
        return None

    def _is_answered(self, number: int) -> bool:
        done = self._done
        return done is not None and (done.lease, done.number) == (self._lease, number)

    def _result(self, done: StepDone, intent: Intent, crossing: Intent | AsCame) -> StepResult:
        if done.failed is not None:
            error = error_of(done.failed)
            if isinstance(error, RobotConfigError):
                raise error
            return self._void(crossing, str(error))
        assert done.result is not None, "what did not fail has a result"
        self._percept, self._measured = done.result.percept, done.measured
        self._pulse.beat()
        if any(verdict.is_latched for verdict in done.result.verdicts):
            self._was_engaged = False
        if not isinstance(crossing, AsCame):
            return done.result
        executed = msgspec.structs.replace(done.result.executed, requested=as_came(intent))
        return msgspec.structs.replace(done.result, executed=executed)

    def _void(self, crossing: Intent | AsCame, why: str) -> StepResult:
        """Return a time step of which nobody knows what came."""
        self._was_engaged = False
        self._pulse.fail(why)
        percept = self.percept
        verdict = Verdict(
            stamp_ns=percept.stamp_ns, sequence=-1, outcome=Outcome.REFUSED, reason=Reason.WIRE.value, detail=why,
            is_latched=True,
        )  # fmt: skip
        executed = Executed(
            duration_s=0.0, moved_m=(0.0, 0.0, 0.0), target_m=percept.tcp_position_m, requested=crossing
        )
        return StepResult(percept=percept, executed=executed, verdicts=(verdict,), is_void=True)

    def _beat(self) -> None:
        """Say that this process is there, as long as it is: a frozen one says nothing, and its lease ends."""
        while not self._is_over.wait(BEAT_S):
            lease = self._lease
            if lease:
                with suppress(BusError):
                    self._beats.put(Beat(lease=lease))

    def _take_step(self, received: Received[StepDone]) -> None:
        with self._came:
            self._known.take(received.message.report)
            self._done = received.message
            self._came.notify_all()

    def _take_report(self, received: Received[StationReport]) -> None:
        with self._came:
            self._known.take(received.message)

    def _take_state(self, received: Received[ArmState]) -> None:
        if not self._was_engaged:
            self._measured = received.message


def _crossing(intent: object) -> Intent | AsCame:
    """Return an intent as it may cross: itself where it is one, by type and fields; else as it came."""
    try:
        return msgspec.convert(msgspec.to_builtins(intent), Intent)
    except (msgspec.ValidationError, TypeError, ValueError, OverflowError, RecursionError):
        return as_came(intent)


def _finite(duration_s: float) -> float:
    return min(max(duration_s, 0.0), 10.0) if duration_s == duration_s else 0.0
