"""The safety gate: the only caller of Arm.write. It passes or refuses; a refusal latches."""

import math
from collections.abc import Callable

import numpy as np

from robot.as_came import AsCame, as_came
from robot.chain import ToolChain
from robot.compiled import Table
from robot.envelope import Envelope
from robot.hal.protocols import Arm
from robot.messages import ArmCommand, ArmMode, ArmState, GripCommand, Outcome, Vec6, Verdict
from robot.safety.at_once import FREE, UNSURE, passed_at_once
from robot.safety.blocks import Block
from robot.safety.checks import (
    Reason,
    Refusal,
    check_finite,
    check_force,
    check_grip,
    check_intent,
    check_intent_age,
    check_joint_range,
    check_joint_speed,
    check_outputs,
    check_percept_age,
    check_push,
    check_sequence,
    check_state,
    check_tool,
    check_tracking,
)
from robot.safety.checks_profile import (
    Points,
    check_cone,
    check_fences,
    check_part_speeds,
    check_soft_margin,
)
from robot.safety.course import JointCourse
from robot.safety.cover import nothing_seen
from robot.safety.cross_check import CrossCheck
from robot.safety.limits import GateLimits
from robot.safety.plain import is_plain, plain_bounds
from robot.safety.stop_check import StopCheck

__all__ = ["Gate"]


class Gate:
    """Stands between motion and one arm. State: the last command sent, and the latch.

    After a refusal nothing is written any more: the arm is stopped where it is, the hand holds what it holds, lamps
    and lids stay as they are, until `seed` after an operator has cleared the latch.
    """

    def __init__(
        self,
        *,
        arm: Arm,
        limits: GateLimits,
        envelope: Envelope,
        chain: ToolChain,
        when_latched: Callable[[Verdict], object] | None = None,
        stops: StopCheck | None = None,
        cross: CrossCheck | None = None,
    ) -> None:
        """Store.

        Args:
            arm: the only thing that is written to.
            limits: what is held.
            envelope: what of the limits profile is held besides.
            chain: where the tool is for given joints.
            when_latched: told of the refusal that latches, before the arm is stopped: a stop takes its time.
            stops: what verifies the stop that would follow each command; None where bodies are no matter.
            cross: what compares the controller's word with our model; None where nobody else has a say.
        """
        self._arm, self._limits, self._envelope, self._chain = arm, limits, envelope, chain
        self._when_latched, self._stops, self._cross = when_latched, stops, cross
        self._sequence = 0
        self._force_before_n = 0.0
        self._course = JointCourse(envelope)
        self._memory: Table = np.array([_flat(chain.points(self._course.last_rad)[0])])
        """Where the last command brought the parts."""
        self._quiet_n = min(limits.contact_n, limits.hard_n, limits.force_max_n)
        self._grip: GripCommand | None = None
        """What the hand was asked when a command passed all checks one by one."""
        self._unlooked = (np.zeros((1, 2)), nothing_seen(), np.zeros((2, 6)))
        """What a StopCheck knows, where there is none: nothing."""
        self._bounds = plain_bounds(limits, envelope, chain)
        self._is_pushed = False
        self._intent_ns = 0
        self._percept_ns: int | None = None
        self._sent: ArmCommand | None = None
        self._latched: Refusal | None = None
        self._is_stop_confirmed = True

    @property
    def is_stop_confirmed(self) -> bool:
        """Whether the plant confirmed the stop of the last refusal that latched."""
        return self._is_stop_confirmed

    @property
    def limits(self) -> GateLimits:
        """What the gate holds."""
        return self._limits

    @property
    def is_latched(self) -> bool:
        """Whether everything is refused until `seed`."""
        return self._latched is not None

    @property
    def sent(self) -> ArmCommand | None:
        """The last command sent, None where none has been since `seed`."""
        return self._sent

    @property
    def next_sequence(self) -> int:
        """Number that the next command must carry."""
        return self._sequence + 1

    def seed(self, state: ArmState) -> None:
        """Start from the measured joints at rest, latch cleared. For the station, after arming or a reset only."""
        self._course.seed(state.q_rad)
        self._points = self._chain.points(state.q_rad)[0]
        self._grip = None
        self._sequence = 0
        self._force_before_n = 0.0
        self._intent_ns = state.stamp_ns
        self._percept_ns = None
        self._sent = None
        self._latched = None
        if self._stops is not None:
            self._stops.seed()
        if self._cross is not None:
            self._cross.seed()

    def admit(self, intent: object, *, now_ns: int) -> Verdict | None:
        """Take note of a fresh intent. A wrong one is refused and latches; None means admitted."""
        refusal = self._latched or check_intent(intent)
        if refusal is None:
            self._intent_ns = now_ns
            return None
        return self._refuse(refusal, stamp_ns=now_ns, refused=as_came(intent))

    def surround(self, blocks: tuple[Block, ...]) -> None:
        """Keep the arm clear of these from now on."""
        if self._stops is not None:
            self._stops.put(blocks)

    def perceive(self, stamp_ns: int) -> None:
        """Take note of when was perceived what the arm is kept clear of. Nothing is asked of its age before."""
        self._percept_ns = stamp_ns

    def write(self, command: ArmCommand, state: ArmState, *, now_ns: int) -> Verdict | None:
        """Send a command, or refuse it and latch. None means it passed and was sent."""
        refusal = self._latched or self._check(command, state, now_ns)
        if refusal is not None:
            return self._refuse(refusal, stamp_ns=now_ns, refused=as_came(command))
        self._course.add(command.q_rad, is_pushed=self._is_pushed)
        self._sequence = command.sequence
        self._arm.write(command)
        self._sent = command
        return None

    def latch(self, reason: Reason, detail: str, *, now_ns: int, refused: ArmCommand | None = None) -> Verdict:
        """Latch for a reason found outside, such as a measurement that did not come, or a command the arm refused."""
        came = None if refused is None else as_came(refused)
        return self._refuse(Refusal(reason, detail), stamp_ns=now_ns, refused=came)

    @property
    def _points(self) -> Points:
        a, b, c, d, e, f, g, h, i = self._memory[0].tolist()
        return (a, b, c), (d, e, f), (g, h, i)

    @_points.setter
    def _points(self, points: Points) -> None:
        self._memory[0] = _flat(points)

    def _check(self, command: ArmCommand, state: ArmState, now_ns: int) -> Refusal | None:
        """Say why not: check by check, unless a command is finite and all the others pass it at once."""
        refusal = check_finite(command)
        if refusal is not None:
            return refusal
        force_n, stops, cross = math.hypot(*state.tcp_force_n), self._stops, self._cross
        if cross is None or not force_n <= self._quiet_n:
            return self._check_each(command, state, now_ns, force_n)
        said = self._at_once(command, state, now_ns, cross)
        if said == UNSURE:
            return self._check_each(command, state, now_ns, force_n)
        self._force_before_n, self._is_pushed = force_n, False
        cross.agree()
        if stops is None:
            return None
        if said == FREE:
            stops.note(command.q_rad)
            return None
        return stops.check(command.q_rad, self._course.last_rad, state)

    def _at_once(self, command: ArmCommand, state: ArmState, now_ns: int, cross: CrossCheck) -> int:
        """Return what passed_at_once says of a command that moves and whose tags are in order; otherwise UNSURE."""
        limits, course, stops = self._limits, self._course, self._stops
        q, last_rad, befores = command.q_rad, course.last_rad, course.only
        oldest_ns = now_ns - limits.state_max_age_ns
        is_in_order = (
            befores is not None
            and command.sequence == self._sequence + 1
            and oldest_ns <= state.stamp_ns <= now_ns
            and oldest_ns <= command.stamp_ns <= now_ns
            and state.mode is ArmMode.RUNNING
            and command.grip is self._grip
            and not command.digital_out & ~limits.output_mask
            and self._force_before_n <= limits.contact_n
            and not cross.is_first
            and 0 <= now_ns - self._intent_ns <= limits.intent_max_age_ns
            and (self._percept_ns is None or 0 <= now_ns - self._percept_ns <= limits.percept_max_age_ns)
            and (stops is None or stops.follows(last_rad))
        )
        if befores is None or not is_in_order or q == last_rad:
            return UNSURE
        known, seen, law = self._unlooked if stops is None else (stops.known, stops.seen, stops.law)
        return passed_at_once(
            (q, last_rad, *befores), (state.q_rad, state.qd_rad_s), state.tcp_speed_m_s, self._memory, known, seen,
            law, self._chain.rows, self._bounds, self._envelope.joint_rows, self._envelope.fence_rows,
        )  # fmt: skip

    def _check_each(self, command: ArmCommand, state: ArmState, now_ns: int, force_n: float) -> Refusal | None:
        """Run the checks in their order. Of a command that holds still it is asked whether it may so soon."""
        limits = self._limits
        refusal = (
            check_sequence(command, self._sequence)
            or check_state(state, command, now_ns, limits)
            or check_force(force_n, self._force_before_n, limits)
            or self._check_push(command.q_rad, state)
            or (None if self._cross is None else self._cross.check(state))
            or check_grip(command, limits)
            or check_outputs(command, limits)
        )
        if refusal is not None:
            return refusal
        self._force_before_n, self._grip = force_n, command.grip
        q, last_rad = command.q_rad, self._course.last_rad
        self._is_pushed = force_n > limits.hard_n
        pushed_rad = state.q_rad if self._is_pushed else None
        if q != last_rad:
            refusal = (
                self._check_place(q, state.q_rad, pushed_rad)
                or check_intent_age(self._intent_ns, now_ns, limits)
                or check_percept_age(self._percept_ns, now_ns, limits)
                or (None if self._stops is None else self._stops.check(q, last_rad, state))
            )
        elif not self._course.is_at_rest:
            refusal = self._course.check(q, pushed_rad)
        return refusal or check_tracking(q, state.q_rad, limits)

    def _check_place(self, q_rad: Vec6, measured_rad: Vec6, pushed_rad: Vec6 | None) -> Refusal | None:
        """Look at where joints lead and how they go there, check by check where that is not plain."""
        limits, envelope, course = self._limits, self._envelope, self._course
        befores = course.only
        if befores is not None:
            is_within, points = is_plain(
                (q_rad, course.last_rad, *befores), measured_rad, self._points, self._chain.rows, self._bounds,
                envelope.joint_rows, envelope.fence_rows,
            )  # fmt: skip
            if is_within:
                self._points = points
                return None
        return (
            check_joint_range(q_rad, limits)
            or check_joint_speed(q_rad, course.last_rad, limits)
            or self._check_parts(q_rad, pushed_rad)
        )

    def _check_push(self, q_rad: Vec6, state: ArmState) -> Refusal | None:
        if q_rad == self._course.last_rad or self._force_before_n <= self._limits.contact_n:
            return None
        (x, y, z), (u, v, w) = self._chain.points(q_rad)[0][0], self._points[0]
        return check_push(state.tcp_force_n, self._force_before_n, (x - u, y - v, z - w), self._limits)

    def _check_parts(self, q_rad: Vec6, pushed_rad: Vec6 | None) -> Refusal | None:
        """Look at where joints lead that are in range and no faster than they may be, and hold the limits profile.

        Args:
            q_rad: the command.
            pushed_rad: where the arm is measured, if the force on its tool says that something holds it: only then a
                command may give way faster than it may go.
        """
        envelope, last_rad = self._envelope, self._course.last_rad
        points, down = self._chain.points(q_rad)
        tcp = points[0]
        refusal = (
            check_tool(tcp, self._chain.lowest_m(tcp, down), self._limits)
            or check_soft_margin(q_rad, last_rad, envelope)
            or self._course.check(q_rad, pushed_rad)
            or check_fences(points, envelope)
            or check_cone(down, envelope)
            or check_part_speeds(points, self._points, self._parts_at(pushed_rad), envelope)
        )
        self._points = points
        return refusal

    def _parts_at(self, q_rad: Vec6 | None) -> Callable[[], Points] | None:
        return None if q_rad is None else lambda: self._chain.points(q_rad)[0]

    def _refuse(self, refusal: Refusal, *, stamp_ns: int, refused: AsCame | None) -> Verdict:
        is_new = self._latched is None
        verdict = self._verdict(refusal, stamp_ns, refused)
        if is_new:
            self._latched = refusal
            try:
                if self._when_latched is not None:
                    self._when_latched(verdict)
            finally:
                self._is_stop_confirmed = self._arm.stop()
        return verdict

    def _verdict(self, refusal: Refusal, stamp_ns: int, refused: AsCame | None) -> Verdict:
        return Verdict(
            stamp_ns=stamp_ns,
            sequence=self._sequence + 1,
            outcome=Outcome.REFUSED,
            reason=refusal.reason.value,
            detail=refusal.detail,
            amount=refusal.amount,
            is_latched=True,
            refused=refused,
        )


def _flat(points: Points) -> tuple[float, ...]:
    (a, b, c), (d, e, f), (g, h, i) = points
    return a, b, c, d, e, f, g, h, i
