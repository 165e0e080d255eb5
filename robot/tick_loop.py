"""What runs each tick of an arm: read, cell, motion, gate, wait. Knows nothing of percepts, reflexes or arming."""

from collections.abc import Callable
from math import isfinite

import msgspec

from config.arm import ArmConfig
from config.limited import limited
from config.limits import Profile
from config.rig import Rig
from config.rules import RuleSet
from config.scenario import Scenario
from robot.cell import Cell
from robot.chain import ToolChain
from robot.envelope import Envelope
from robot.errors import ArmRefusedError, RobotConfigError, StaleStateError, WireError
from robot.hal.protocols import Arm
from robot.messages import ArmCommand, ArmState, GripCommand, Intent, Limited, Vec3, Verdict
from robot.motion import Approach, Mover
from robot.safety import (
    Braking,
    Clearance,
    CrossCheck,
    Gate,
    GateLimits,
    Hard,
    Obstacles,
    Reason,
    StopCheck,
    check_profile_fits,
)
from robot.surroundings import Surroundings
from robot.tick_tap import TickTap

__all__ = ["Stride", "TickLoop", "guarded"]

WHOLE_TICKS = 1e-6
AHEAD_M = 0.004
"""How much farther from bodies than the gate refuses joints begin to brake; their targets rest at twice that."""

LEAF_M = 0.012
"""How far motion keeps fingers off leaves that stand; the gate lets them touch. Fingers are the fastest there is."""


class Stride(msgspec.Struct, frozen=True, kw_only=True):
    """What one time step of the loop came to."""

    before: ArmState
    """At the end of the one before: the arm may have gone on meanwhile."""
    after: ArmState
    is_begun: bool
    """The gate admitted the intent; otherwise no time has passed."""
    target_m: Vec3
    """Where the tool centre point will rest if nothing more is asked."""
    limiters: tuple[str, ...]
    is_in_contact: bool
    limited: tuple[Limited, ...] = ()
    """The limiters, each with by how much."""
    verdict: Verdict | None = None
    """The gate's refusal, if it refused."""
    unseen: tuple[str, ...] = ()
    """Things that were not perceived when it began."""
    sent: ArmCommand | None = None
    """The last command that was sent, None where none has been since command was taken."""


def guarded(
    *,
    arm: Arm,
    config: ArmConfig,
    scenario: Scenario,
    rig: Rig,
    profile: Profile,
    when_latched: Callable[[Verdict], object] | None,
) -> tuple[Mover, Gate]:
    """Return motion and gate of one arm at one table, bodies kept apart by both, by distances that each has of its own.

    The arm's file is already no wider than the profile.
    """
    table_m, tick_s, braking = scenario.table.height_m, rig.tick_s, Braking()
    clear = profile.clearances
    hard = Hard(own_m=clear.self_m, table_m=clear.scene_m, thing_m=clear.scene_m)
    envelope = Envelope.of(profile, config, tick_s=tick_s)
    limits = GateLimits.of(config, arm.spec, table_m=table_m, tick_s=tick_s)
    shaped = msgspec.structs.replace(hard, leaf_m=LEAF_M)
    approach = Approach(config, Clearance(config, scenario, hard=shaped), braking=braking)
    farther = shaped.farther(AHEAD_M)
    onset_s = max(joint.acceleration_rad_s2 / joint.jerk_rad_s3 for joint in config.joints)
    stops, soon = (
        StopCheck(
            config,
            Clearance(config, scenario, hard=kept),
            limits=limits,
            tick_s=tick_s,
            braking=braking,
            lead_s=lead_s,
            envelope=envelope,
        )
        for kept, lead_s in ((hard, 0.0), (farther, tick_s + onset_s))
    )
    mover = Mover(config, envelope=envelope, table_m=table_m, tick_s=tick_s, approach=approach, stops=soon)
    chain = ToolChain(config)
    gate = Gate(
        arm=arm, limits=limits, envelope=envelope, chain=chain, when_latched=when_latched, stops=stops,
        cross=CrossCheck(chain),
    )  # fmt: skip
    return mover, gate


class TickLoop:
    """One arm's motion, cell and gate. After a refusal it must be seeded again before anything moves.

    Attributes:
        state: The newest measurement.
        is_resting: Whether it rests, or comes to rest, for want of an intent.
    """

    def __init__(
        self,
        *,
        arm: Arm,
        config: ArmConfig,
        scenario: Scenario,
        rule_sets: tuple[RuleSet, ...],
        rig: Rig,
        profile: Profile,
        when_latched: Callable[[Verdict], object] | None = None,
        tap: TickTap | None = None,
    ) -> None:
        """Put the parts together; the arm is not connected to.

        Args:
            arm: what is driven.
            config: the arm's file.
            profile: what of it may be used.
            scenario: the table.
            rule_sets: one for each span of the scenario's schedule.
            rig: how long a tick is.
            when_latched: told of a refusal before the arm is stopped for it.
            tap: hears of every tick.

        Raises:
            RobotConfigError: the arm's tick is another, or the profile allows more than the arm can do.
        """
        if abs(arm.spec.rate_hz * rig.tick_s - 1.0) > WHOLE_TICKS:
            raise RobotConfigError(f"rig {rig.name}: tick {rig.tick_s} s, the plant's is {1 / arm.spec.rate_hz} s")
        self._arm, self._tap = arm, tap
        check_profile_fits(profile, arm.spec)
        config = limited(config, profile)
        self._cell = Cell(scenario=scenario, rule_sets=rule_sets, arm=config)
        self._mover, self._gate = guarded(
            arm=arm, config=config, scenario=scenario, rig=rig, profile=profile, when_latched=when_latched
        )
        self._obstacles = Obstacles(scenario)
        self._percept_max_age_ns = round(config.motion.percept_max_age_s * 1e9)
        self._intent_max_age_ns = round(config.motion.intent_max_age_s * 1e9)
        self._tick_s, self._tick_ns = rig.tick_s, round(rig.tick_s * 1e9)
        self.state: ArmState
        self._read_ns = self._epoch = 0
        self._n_asked = self._intent_ns = 0
        """Ticks still to come of the newest intent, and when it was asked for, arm's time."""
        self.is_resting = True
        self._before: ArmState

    @property
    def is_in_contact(self) -> bool:
        """Whether something holds the tool up."""
        return self._mover.is_in_contact

    @property
    def gate(self) -> Gate:
        """The last say, for whoever checks it past all shaping."""
        return self._gate

    @property
    def why_lost(self) -> str | None:
        """Nothing: what runs in this process cannot end without it, and latches only in a time step."""
        return None

    def connect(self) -> None:
        """Acquire the arm. Moves nothing."""
        self._arm.connect()

    def measure(self) -> ArmState:
        """Read the arm, in command of it or not. Moves nothing."""
        return self._arm.read()

    def engage(self) -> None:
        """Take command of the arm, after somebody has armed it."""
        self._arm.engage()

    def stop(self) -> None:
        """Stop the arm; it must be seeded again before anything moves."""
        self._arm.stop()

    def await_rest(self) -> None:
        """Return: what runs in this process has waited for that in its stop."""

    @property
    def is_stop_confirmed(self) -> bool:
        """Whether the plant confirmed the stop of the last refusal."""
        return self._gate.is_stop_confirmed

    def close(self) -> None:
        """Stop and release the arm. Idempotent, never raises."""
        self._arm.stop()
        self._arm.close()

    def begin_epoch(self, epoch: int) -> int:
        """Return the outputs that an epoch begins with. Its rules are in force from the seed that follows.

        Until then ticks go on that hold the arm where it stands, in a lid's way perhaps: no output changes
        before the reset.
        """
        self._epoch = epoch
        return self._cell.outputs_at(epoch)

    def seed(self) -> ArmState:
        """Start everything from the measured state, and return it.

        What was pressed since the epoch was begun counts no more: until a reset has moved the arm, ticks that hold it
        go on where it stood, on a button perhaps.
        """
        self._cell.begin_epoch(self._epoch)
        state = self._before = self._read_now()
        self._gate.seed(state)
        self._mover.seed(state)
        self._n_asked, self.is_resting = 0, True
        self._obstacles.seed(state.digital_out, state.stamp_ns)
        self._surround()
        return state

    def perceive(self, around: Surroundings) -> None:
        """Keep clear of things where they are perceived, from now on."""
        self._gate.perceive(around.stamp_ns)
        is_changed = self._obstacles.perceive(around)
        is_changed |= self._obstacles.watch(self.state.digital_out, self.state.tcp_position_m, self.state.stamp_ns)
        if is_changed:
            self._surround()

    def _surround(self) -> None:
        blocks = self._obstacles.blocks
        self._mover.surround(blocks)
        self._gate.surround(blocks)

    def stride(
        self,
        intent: Intent,
        grip: GripCommand,
        *,
        n_ticks: int,
        wait_at_m: Vec3 | None = None,
        around: Surroundings | None = None,
    ) -> Stride:
        """Carry out an intent for so many ticks.

        Args:
            intent: what to do, if the gate admits it.
            grip: what the hand does meanwhile.
            n_ticks: how long.
            wait_at_m: where in the plane the tool waits for the hand, base frame; None where it need not wait.
            around: what is perceived; None where nobody perceives anything.
        """
        verdict = self.begin(intent, n_ticks=n_ticks, wait_at_m=wait_at_m, around=around)
        if verdict is not None:
            return self.report(verdict, is_begun=False)
        for _ in range(n_ticks):
            verdict = self.tick(grip)
            if verdict is not None:
                break
        return self.report(verdict, is_begun=True)

    def begin(
        self,
        intent: Intent,
        *,
        n_ticks: int,
        wait_at_m: Vec3 | None = None,
        around: Surroundings | None = None,
        n_left: int | None = None,
        asked_ns: int | None = None,
    ) -> Verdict | None:
        """Begin to carry out an intent; ticks do the rest. Returns the gate's refusal, if it refused.

        With a percept that is too old nothing moves on: the arm comes to rest. So it does in ticks beyond those that
        were asked for, once the intent is too old.

        Args:
            intent: what to do, if the gate admits it.
            n_ticks: how long; the rest as in `stride`.
            wait_at_m: where the tool waits.
            around: what is perceived.
            n_left: how many of these ticks are still to come; None for all.
            asked_ns: when it was asked for, arm's time; None where that was now.
        """
        before, now_ns = self.state, self._arm.clock.now_ns()
        verdict = self._gate.admit(intent, now_ns=now_ns)
        if verdict is not None:
            return self._told(verdict)
        if wait_at_m is not None and not all(map(isfinite, wait_at_m)):
            return self.latch(Reason.NOT_FINITE, f"expected a place to wait at, came {wait_at_m}")
        self._n_asked, self.is_resting = n_ticks if n_left is None else n_left, False
        self._intent_ns = now_ns if asked_ns is None else asked_ns
        if around is not None:
            self.perceive(around)
            if now_ns - around.stamp_ns > self._percept_max_age_ns:
                self._mover.hold("percept_age")
                return None
        duration_s = n_ticks * self._tick_s
        if wait_at_m is None:
            self._mover.begin_step(intent, before, duration_s=duration_s)
        else:
            self._mover.wait_at(wait_at_m, before)
        return None

    def latch(self, reason: Reason, detail: str) -> Verdict:
        """Stop the arm and latch, for a reason that was found outside."""
        return self._told(self._gate.latch(reason, detail, now_ns=self._arm.clock.now_ns()))

    def rest(self) -> None:
        """Come to rest and stay there: what ticks do when the last intent is too old."""
        self._n_asked, self.is_resting = 0, True
        self._mover.hold("no_intent")

    def _rest_in_silence(self) -> None:
        if self._n_asked:
            self._n_asked -= 1
        elif not self.is_resting and self._arm.clock.now_ns() - self._intent_ns >= self._intent_max_age_ns:
            self.rest()

    def tick(self, grip: GripCommand) -> Verdict | None:
        """Run one tick and return the gate's refusal, if it refused."""
        arm, gate = self._arm, self._gate
        now_ns = arm.clock.now_ns()
        command: ArmCommand | None = None
        try:
            state = self._read(now_ns)
            now_ns = arm.clock.now_ns()  # on a wall clock the state read is newer than the tick's beginning
            digital_out = self._cell.tick(state)
            if self._obstacles.watch(digital_out, state.tcp_position_m, state.stamp_ns):
                self._surround()
            command = ArmCommand(
                stamp_ns=now_ns,
                sequence=gate.next_sequence,
                q_rad=self._mover.tick(state),
                grip=grip,
                digital_out=digital_out,
            )
            verdict = gate.write(command, state, now_ns=now_ns)
            if self._tap is not None:
                self._tap.commanded(command, self._mover.limiters, verdict)
            if verdict is None:
                arm.clock.wait_tick()
                self._read_now()
                self._rest_in_silence()
        except WireError as error:
            untaken = None if command is gate.sent else command
            return self._told(gate.latch(_reason_of(error), str(error), now_ns=now_ns, refused=untaken))
        return verdict

    def _told(self, verdict: Verdict) -> Verdict:
        if self._tap is not None:
            self._tap.refused(verdict)
        return verdict

    def _read(self, now_ns: int) -> ArmState:
        """Return the newest state, which the one read at the end of the tick before is, unless time passed since."""
        return self._read_now() if now_ns - self._read_ns >= self._tick_ns else self.state

    def _read_now(self) -> ArmState:
        self._read_ns = self._arm.clock.now_ns()
        self.state = self._arm.read()
        if self._tap is not None:
            self._tap.measured(self.state)
        return self.state

    def report(self, verdict: Verdict | None, *, is_begun: bool) -> Stride:
        """Return what the time step that was begun last came to, and what it did on its way from the one before."""
        mover, before, self._before = self._mover, self._before, self.state
        return Stride(
            before=before,
            after=self.state,
            is_begun=is_begun,
            target_m=mover.target_m,
            limiters=mover.limiters,
            limited=mover.limited,
            is_in_contact=mover.is_in_contact,
            verdict=verdict,
            unseen=self._obstacles.unseen,
            sent=self._gate.sent,
        )


def _reason_of(error: WireError) -> Reason:
    """Return why nothing may move: nothing is known of the arm, it does not obey, or another wire failed."""
    if isinstance(error, StaleStateError):
        return Reason.STALE_STATE
    return Reason.ARM_REFUSED if isinstance(error, ArmRefusedError) else Reason.WIRE
