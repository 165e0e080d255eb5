"""A station: perception and the hand's reflexes around a loop that holds the arm, and the arming of it all."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from time import monotonic_ns
from types import TracebackType

import msgspec

from config.arm import ArmConfig
from config.rig import Rig
from config.scenario import Scenario
from robot.as_came import as_came
from robot.errors import RobotConfigError, RobotError, SafetyError, WireError
from robot.messages import (
    ArmState,
    Executed,
    Grip,
    Intent,
    Outcome,
    Percept,
    PlantIdentity,
    StationSpec,
    StationState,
    StepResult,
    Verdict,
)
from robot.motion import Hand, HandReflexes
from robot.safety import Answer, Arming, ArmingButton, Challenges, Lease, Reason, Tenure, draw_code
from robot.station_doors import Loop, Perceives, Sighted, World
from robot.surroundings import Lookout, Surroundings
from robot.tick_loop import Stride

__all__ = ["LocalStation"]

WHOLE_TICKS = 1e-6
MAX_STEP_S = 10.0


class LocalStation:
    """Implements robot.station.Station over one loop, and Armable for an operator.

    Each tick of the loop: read, cell, motion, gate, wait. The percept is made once, at the end of a step; the hand's
    reflexes are decided once, at its beginning. After arming, a reset or a latch everything starts from the measured
    state, so that an epoch depends on nothing before its reset.

    It is armed for one source, one profile and one lease. With any of them what it was armed for ends: at the next look
    it stops the arm and is disarmed. A lease is renewed by every step.
    """

    def __init__(
        self,
        *,
        world: World,
        loop: Loop,
        perception: Perceives,
        arm: ArmConfig,
        scenario: Scenario,
        rig: Rig,
        hand: Hand | None = None,
        cell_shows: Callable[[str], None] | None = None,
        arming_signal: int | None = None,
        host_ns: Callable[[], int] = monotonic_ns,
    ) -> None:
        """Put the parts together; nothing is connected to.

        Args:
            world: the plant, besides its arm.
            loop: what holds the arm.
            perception: what makes percepts.
            arm: the arm's file.
            scenario: the table.
            rig: what may be armed, and how often it may latch.
            hand: decides what the fingers do; the reflexes where None.
            cell_shows: shows a text at the cell, as on the arm's pendant; None where only a console can.
            arming_signal: input of a button at the cell that arms; None where there is none.
            host_ns: this process's monotonic time, by which leases expire and answers are late.
        """
        table_m = scenario.table.height_m
        self._world, self._loop, self._perception, self._rig = world, loop, perception, rig
        self._reflexes: Hand = HandReflexes(arm=arm, scenario=scenario) if hand is None else hand
        self._arming = Arming(
            expected=rig.expected, max_latches=rig.max_latches, latch_window=rig.latch_window,
            challenges=Challenges(now_ns=host_ns, draw=draw_code),
        )  # fmt: skip
        self._cell_shows = cell_shows
        self._lookout = Lookout(scenario, max_age_s=arm.motion.percept_max_age_s)
        self._button = None if arming_signal is None else ArmingButton(signal=arming_signal, now_ns=host_ns)
        self._tenure = Tenure(arming=self._arming, profile=rig.profile, now_ns=host_ns)
        self._spec = StationSpec(
            n_distances=len(scenario.distances),
            n_buttons=len(scenario.buttons),
            distance_names=scenario.distances,
            step_s=arm.motion.step_s,
            max_step_m=arm.motion.max_step_m,
            heights_m=arm.motion.heights_m,
            workspace_m=arm.motion.workspace_m,
            table_height_m=table_m,
        )
        self._percept: Percept
        self._measured: ArmState
        self._is_connected = False

    def __enter__(self) -> "LocalStation":
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def spec(self) -> StationSpec:
        """What may be known before the first step."""
        return self._spec

    @property
    def state(self) -> StationState:
        """Mode and, when latched, why. Command that was lost between time steps latches here."""
        if self._arming.is_engaged:
            why = self._loop.why_lost
            if why is not None:
                self._arming.latch(why)
        self._hold_to_grant()
        return self._arming.state

    @property
    def identity(self) -> PlantIdentity:
        """Which world this is."""
        return self._world.identity

    @property
    def measured(self) -> ArmState:
        """What the arm measured last, at the end of a step, a reset or engaging."""
        return self._measured

    @property
    def percept(self) -> Percept:
        """What was perceived last."""
        return self._percept

    def look_at(self, state: ArmState) -> Surroundings:
        """Perceive anew at a measurement, for whoever checks the gate past the station's door."""
        return self._lookout.see(self._perceive(state))

    @property
    def loop(self) -> Loop:
        """Who holds the arm, for whoever checks it past the station's door."""
        return self._loop

    @property
    def model_sha256(self) -> str | None:
        """Digest of the world's model, where it is a simulated one in this process."""
        return getattr(self._world, "model_sha256", None)

    @property
    def n_latches(self) -> int:
        """How often the station has latched since it was made."""
        return self._arming.n_latches

    @property
    def latch_reasons(self) -> tuple[str, ...]:
        """Why it has latched since it was made, oldest first."""
        return tuple(self._arming.reasons)

    def connect(self) -> None:
        """Acquire the plant. Moves nothing. Idempotent."""
        if not self._is_connected:
            self._loop.connect()
            if isinstance(self._perception, Sighted):
                self._perception.connect()
            self._is_connected = True

    def take_lease(self, source: str, *, life_ns: int | None = None) -> Lease:
        """Give the lease to a source; without a step for longer than its life it ends (None: it never does).

        Raises:
            SafetyError: another source has it.
        """
        lease = self._tenure.take(source, life_ns=life_ns)
        self._hold_to_grant()
        return lease

    def hand_over(self, to: str, *, life_ns: int | None = None) -> Lease:
        """Give the lease to another source: the arm is stopped, and must be armed for that one anew.

        Raises:
            SafetyError: nobody has the lease.
        """
        lease = self._tenure.hand_over(to, life_ns=life_ns)
        self._hold_to_grant()
        return lease

    @property
    def lease_number(self) -> int:
        """Of the lease in force; 0 where there is none."""
        grant = self._tenure.grant
        return 0 if grant is None else grant.lease

    def renew_lease(self) -> None:
        """Say that who has the lease is still there; one that has ended stays so."""
        self._tenure.renew()

    def keep_lease(self) -> None:
        """Say that who has the lease was heard while nobody could look: one that has run out meanwhile goes on."""
        self._tenure.keep()

    def let_go(self) -> None:
        """Let go of the lease: the arm is stopped and disarmed; a latch stays."""
        was_engaged = self._arming.is_engaged
        self._tenure.end()
        if was_engaged:
            self._loop.stop()

    def give_hand(self, hand: Hand) -> None:
        """Have another decide what the fingers do, before it is engaged.

        Raises:
            SafetyError: it is engaged.
        """
        if self._arming.is_engaged:
            raise SafetyError("another hand: expected a station that is not engaged, it is")
        self._reflexes = hand

    def measure(self) -> ArmState:
        """Read the arm, in command of it or not. Moves nothing."""
        return self._loop.measure()

    def stop(self, *, by: str) -> None:
        """Stop the arm. Anybody may, whoever has the lease: what was engaged latches, what was armed is disarmed."""
        was_engaged = self._arming.is_engaged
        self._arming.stop(f"stopped by {by}")
        if was_engaged:
            self._loop.stop()

    def challenge(self) -> str | None:
        """Let the cell show a code for arming; return it where only a console can show it. For an operator."""
        self.connect()
        grant = self._tenure.renewed()
        code = self._arming.challenge(grant)
        if self._button is not None:
            self._button.ask(code)
        if self._cell_shows is None:
            return code
        press = "" if self._button is None else "press the arming button, or "
        self._cell_shows(f"autotelic: to arm for {grant}, {press}type {code}")
        return None

    @property
    def has_button(self) -> bool:
        """Whether a button at the cell answers a challenge."""
        return self._button is not None

    def pressed(self) -> Answer | None:
        """Look once at the cell's arming button, by the arm's own inputs; its press since the challenge is the answer.

        Raises:
            SafetyError: there is no such button, nothing was asked, or nobody has pressed in time.
            WireError: the arm cannot be read.
        """
        if self._button is None:
            raise SafetyError("expected a cell with an arming button (arming_signal), this one has none")
        return self._button.see(self._loop.measure().digital_in)

    def arm(self, *, by: str, answer: Answer | None = None) -> None:
        """Go from disarmed to armed, if this is the plant that the rig names. For an operator."""
        self.connect()
        self._arming.arm(identity=self._world.identity, by=by, grant=self._tenure.renewed(), answer=answer)

    def engage(self) -> None:
        """Go from armed to engaged: everything starts from the measured state. For an operator.

        Raises:
            RobotError: command was not taken, or was lost meanwhile; it is latched for that.
        """
        self._arming.require_armed()
        with self._latched_by_failure():
            self._loop.engage()
            self._tenure.renewed()
            self._arming.engage()
            self._seed()

    def reset_plant(self, *, seed: int, epoch: int) -> None:
        """Lay the table out in any mode. Clears no latch. For an operator."""
        digital_out = self._loop.begin_epoch(epoch)
        self._world.resetter.reset(seed=seed, epoch=epoch, digital_out=digital_out)
        self._arming.note_plant_reset()

    def clear_latch(self, *, by: str, answer: Answer | None = None) -> None:
        """Go from latched to armed, after the plant's reset only. For an operator."""
        self._arming.clear_latch(identity=self._world.identity, by=by, grant=self._tenure.renewed(), answer=answer)

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Lay the table out for an epoch and return the first percept.

        Raises:
            NotEngagedError: the station is not engaged; a latch is never cleared here.
            RobotError: the table was not laid out, or command was lost meanwhile; it is latched for that.
        """
        self._require_command()
        with self._latched_by_failure():
            self.reset_plant(seed=seed, epoch=epoch)
        self._tenure.renewed()  # the source waited for it
        self._require_command()
        with self._latched_by_failure():
            self._loop.engage()  # a plant that stopped its arm for the reset took command away
            return self._seed()

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        """Carry out an intent for one time step and return the percept after it.

        Raises:
            NotEngagedError: the station is not engaged.
            RobotConfigError: the duration is not a whole number of ticks from one up.
        """
        self._hold_to_grant()
        self._arming.require_engaged()
        self._tenure.renewed()
        duration = self._spec.step_s if duration_s is None else duration_s
        n_ticks = self._whole_ticks(duration)
        grip = self._reflexes.decide(self._percept, _grip_of(intent))
        around = self._lookout.see(self._percept)
        stride = self._loop.stride(intent, grip, n_ticks=n_ticks, wait_at_m=self._reflexes.wait_at_m, around=around)
        if stride.verdict is not None:
            self._arming.latch(f"{stride.verdict.reason}: {stride.verdict.detail}")
        return self._result(intent, stride, duration if stride.is_begun else 0.0)

    def close(self) -> None:
        """Stop and release, connected to or not: the loop may hold more than an arm. Idempotent, never raises."""
        self._loop.close()
        if isinstance(self._perception, Sighted):
            self._perception.close()
        self._is_connected = False
        self._tenure.end()

    def _hold_to_grant(self) -> None:
        """Stop where what the station was armed for is gone."""
        if not self._tenure.holds():
            self._loop.stop()

    def _require_command(self) -> None:
        """Raise NotEngagedError unless engaged, and latch what was lost unnoticed: no reset takes the arm again."""
        _ = self.state
        self._arming.require_engaged()

    @contextmanager
    def _latched_by_failure(self) -> Generator[None]:
        """Stop and latch where taking command, or laying the table out, fails: nobody knows who holds the arm then."""
        try:
            yield
        except RobotConfigError:
            raise
        except RobotError as error:
            self._arming.latch(str(error))  # told first: stopping takes its time
            self._loop.stop()
            raise

    def _seed(self) -> Percept:
        """Start everything from the measured state."""
        state = self._loop.seed()
        if isinstance(self._perception, Sighted):
            self._perception.forget()
        percept = self._perceive(state)
        self._reflexes.reset(percept)
        return percept

    def _perceive(self, state: ArmState) -> Percept:
        truth = self._world.truth
        percept = self._perception.perceive(state, None if truth is None else truth.read())
        if self._loop.is_in_contact:
            percept = msgspec.structs.replace(percept, is_in_contact=True)
        self._percept, self._measured = percept, state
        return percept

    def _result(self, intent: Intent, stride: Stride, duration_s: float) -> StepResult:
        (x0, y0, z0), (x1, y1, z1) = stride.before.tcp_position_m, stride.after.tcp_position_m
        is_lost = self._reflexes.lost_object
        verdicts = () if stride.verdict is None else (stride.verdict,)
        try:
            percept = self._perceive(stride.after)
        except WireError as error:
            percept = self._percept  # nothing newer is known, and the step counts for nothing
            verdicts = (*verdicts, self._lose_sight(stride.after, str(error)))
        return StepResult(
            percept=percept,
            executed=Executed(
                duration_s=duration_s,
                moved_m=(x1 - x0, y1 - y0, z1 - z0),
                target_m=stride.target_m,
                limiters=(*stride.limiters, "object_lost") if is_lost else stride.limiters,
                limited=stride.limited,
                unseen=stride.unseen,
                requested=intent if stride.is_begun and isinstance(intent, Intent) else as_came(intent),
                sent=stride.sent,
            ),
            verdicts=verdicts,
            is_void=is_lost or bool(verdicts),
        )

    def _lose_sight(self, state: ArmState, why: str) -> Verdict:
        """Stop and latch: without a percept nobody may move the arm on."""
        reason = Reason.STALE_STATE.value
        self._arming.latch(f"{reason}: {why}")  # told first: stopping takes its time
        self._loop.stop()
        return Verdict(
            stamp_ns=state.stamp_ns, sequence=-1, outcome=Outcome.REFUSED, reason=reason, detail=why, is_latched=True
        )

    def _whole_ticks(self, duration_s: float) -> int:
        n = round(duration_s / self._rig.tick_s) if 0.0 < duration_s <= MAX_STEP_S else 0
        if n < 1 or abs(n * self._rig.tick_s - duration_s) > WHOLE_TICKS:
            expected = f"whole ticks of {self._rig.tick_s} s up to {MAX_STEP_S} s"
            raise RobotConfigError(f"duration_s: expected {expected}, came {duration_s}")
        return n


def _grip_of(intent: object) -> Grip | None:
    """Return what an intent asks of the hand; of what is no intent, nothing: the gate will refuse it."""
    grip = getattr(intent, "grip", None)
    return grip if isinstance(grip, Grip) else None
