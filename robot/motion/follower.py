"""The set-point that follows a target: straight lines of the tool pointing down, or joints, jerk-limited either way."""

import math
from operator import le

from config.arm import ArmConfig
from robot.envelope import Envelope
from robot.geometry import between, turn_about_vertical, unwound, vec6
from robot.kinematics import Kinematics, UnreachableError
from robot.messages import Vec3, Vec6
from robot.motion.ahead import Ahead
from robot.motion.chords import share_of_speed
from robot.motion.commands import Commands
from robot.motion.free import free_bounds
from robot.motion.guarding import guarded_share, is_guarded, share_of_line
from robot.motion.holding import Place, slid
from robot.motion.lean import Lean
from robot.motion.limiter import AxisLimits, Limiter
from robot.motion.pacing import braked, part_way, window
from robot.motion.swinging import SWING_S
from robot.motion.upright import free_step, upright_step

__all__ = ["SWIFT_TICK_S", "Follower"]

SPEED_SHARE = 0.95
"""Share of a joint's greatest speed that motion uses, so that the gate's limit is never met by rounding."""
RATE_SHARE = 0.97
"""Likewise of joints' acceleration and jerk."""
ALIGN_RAD = 0.01
"""A tool tilted or turned by less than this points down as far as motion cares; the next ticks set it right."""
SWIFT_TICK_S = 0.005
"""In shorter ticks than this, a real arm's and not the twin's, a new target is gone to one tick after it was set, and
the mover finds it piece by piece: the tick in which an intent begins has enough to do."""
STILL_RAD_S = 1e-3
ALIGN_STEP_RAD = 0.35
"""Greatest change of any joint's target in one step while the tool is brought upright."""
TURN_RAD_S, TURN_RAD_S2, TURN_RAD_S3 = 2.0, 10.0, 200.0
"""Bounds of the tool's turn about the vertical."""


class Follower:
    """Joint set-points of one arm, tick by tick.

    While the tool points down its coordinates (x, y, z, yaw) are limited and joints follow by inverse kinematics, so
    that it moves straight and never past its target. For joint targets, or while the tool is not upright, the joints
    themselves are limited.

    Attributes:
        q_rad: Joints of the last tick.
        q_before_rad: Those of the tick before.
        target_m: Where the tool centre point will rest.
        yaw_rad: Turn at which it will rest.
        trouble: What went wrong in the last tick, if anything: the joints brake.
        held: What held the last tick back and by which share of its step, if anything did.
        most_m_s: How fast the tool may go towards new targets, for what holds it.
    """

    def __init__(
        self,
        arm: ArmConfig,
        *,
        envelope: Envelope,
        tick_s: float,
        tip_min_m: float = -math.inf,
        guard_z_m: float = -math.inf,
    ) -> None:
        """Put the parts together.

        Args:
            arm: the arm's file.
            envelope: what of the limits profile is held.
            tick_s: how long a tick is.
            tip_min_m: how low fingertips may go on the way to joints, base frame; upright, their target sees to it.
            guard_z_m: below this height the tool goes down and sideways at guarded speed, base frame.
        """
        motion, joints = arm.motion, arm.joints
        self._envelope = envelope
        self._commands = Commands(round(SWING_S / tick_s) + 1)
        """The oldest two are a step SWING_S ago."""
        self._fence_names = {fence.name for fence in envelope.fences}
        self._is_swift = tick_s < SWIFT_TICK_S
        self._kinematics = Kinematics(arm, is_swift=True)
        self._ahead = Ahead(self._kinematics.chain, envelope, tip_min_m=tip_min_m)
        self._lean = Lean(tick_s=tick_s)
        self._home_yaw_rad = arm.tool_yaw_rad
        self._guard_z_m, self._guarded_m_s, self._speed_m_s = guard_z_m, motion.guarded_speed_m_s, motion.speed_m_s
        self.most_m_s, self._tick_s = math.inf, tick_s
        self._tool = Limiter(
            AxisLimits(
                speed=(*(motion.speed_m_s,) * 3, TURN_RAD_S),
                acceleration=(*(motion.acceleration_m_s2,) * 3, TURN_RAD_S2),
                jerk=(*(motion.jerk_m_s3,) * 3, TURN_RAD_S3),
            ),
            tick_s=tick_s,
        )
        self._joints = Limiter(
            AxisLimits(
                speed=tuple(SPEED_SHARE * j.speed_rad_s for j in joints),
                acceleration=tuple(RATE_SHARE * j.acceleration_rad_s2 for j in joints),
                jerk=tuple(RATE_SHARE * j.jerk_rad_s3 for j in joints),
            ),
            tick_s=tick_s,
        )
        self._joint_step_rad = vec6([SPEED_SHARE * j.speed_rad_s * tick_s for j in joints])
        self._chain_rows, downward = self._kinematics.chain.rows, self._kinematics.downward
        self._reach = None if downward is None else downward.reach
        self._bounds = free_bounds(envelope, self._kinematics.chain, tip_min_m=tip_min_m)
        self.seed(arm.home_rad)

    def seed(self, q_rad: Vec6) -> None:
        """Rest at these joints; everything before is forgotten."""
        self.q_rad = self.q_before_rad = self._q_earlier_rad = q_rad
        self.trouble: str | None = None
        self.held: tuple[str, float] | None = None
        self._is_fenced = False
        self._commands.seed(q_rad, self._kinematics.chain.points(q_rad))
        self.target_m = self._kinematics.tcp(q_rad)
        self.yaw_rad = self._home_yaw_rad
        self._is_upright = self._is_solved = False
        self._to_come: list[float] | None = None
        self._joints.seed(list(q_rad))
        self._lean.begin(q_rad, None)
        self._take_up_tool()

    def tcp(self, q_rad: Vec6) -> Vec3:
        """Return the tool centre point for joint angles, base frame, metres."""
        return self._kinematics.tcp(q_rad)

    def points(self, q_rad: Vec6) -> Place:
        """Return tool centre point, flange and elbow, and how far the tool points down (chain.ToolChain)."""
        return self._kinematics.chain.points(q_rad)

    def tcp_and_lowest(self, q_rad: Vec6) -> tuple[Vec3, float]:
        """Return the tool centre point and the height of the lowest fingertip, base frame, metres."""
        return self._kinematics.chain.tcp_and_lowest(q_rad)

    @property
    def is_upright(self) -> bool:
        """Whether the tool points down and moves straight."""
        return self._is_upright

    @property
    def joint_target_rad(self) -> Vec6:
        """Where the joints will rest, as far as it is known before they get there."""
        return self.q_rad if self._is_upright else vec6(self._joints.target)

    def aim(self, target_m: Vec3, yaw_rad: float) -> bool:
        """Go to a place with the tool pointing down. Returns False where no joints lead there; then nothing changes."""
        if not self._is_upright:
            self._take_up_tool()
        if self._is_upright:
            if self._is_swift:
                self._is_due = self._to_come is not None  # targets that come every tick may not put it off for good
                self._to_come = [*target_m, yaw_rad]
            else:
                self._aim_tool([*target_m, yaw_rad])
            self.target_m, self.yaw_rad = target_m, yaw_rad
            return True
        return self._align(target_m, yaw_rad)

    def aim_joints(self, q_rad: Vec6) -> None:
        """Go to joint angles."""
        if self._is_upright:
            self._take_up_joints()
        chain, most = self._kinematics.chain, self._joint_step_rad
        steps_m = self._greatest_steps(chain.tcp(q_rad))
        self._joints.slow_to(share_of_speed(self.q_rad, q_rad, chain, most, steps_m))
        self._joints.aim(list(q_rad))
        self.target_m = self._kinematics.tcp(q_rad)

    def _greatest_steps(self, to_m: Vec3) -> Vec3:
        """Return how far parts may go in a tick on the way to a place: low over the table the tool as guarded."""
        (tcp_m, flange_m, elbow_m), most_m = self._envelope.part_step_m, self.most_m_s * self._tick_s
        if is_guarded(self._commands.tcp_m, to_m, self._guard_z_m):
            tcp_m = min(tcp_m, self._guarded_m_s * self._tick_s)
        return min(tcp_m, most_m), min(flange_m, most_m), elbow_m

    def joints_at(self, place_m: Vec3, yaw_rad: float | None = None, seed_rad: Vec6 | None = None) -> Vec6 | None:
        """Return joints near the present ones that bring the tool to a place; None where none do, or it is tilted.

        Args:
            place_m: where the tool centre point would be.
            yaw_rad: its turn; the one at which it will rest where absent.
            seed_rad: neighbours of the answer; the present joints where absent.
        """
        if not self._is_upright:
            return None
        try:
            yaw = self.yaw_rad if yaw_rad is None else yaw_rad
            return self._kinematics.solve(place_m, self.q_rad if seed_rad is None else seed_rad, yaw_rad=yaw)
        except UnreachableError:
            return None

    def let_go(self) -> None:
        """Where a fence holds the tool up, want no more than where it is: no way back begins behind the fence."""
        if self._is_fenced and self._is_upright:
            x, y, z, _ = self._tool.at
            self.target_m = x, y, z
        self._is_fenced = False

    def brake(self) -> None:
        """Come to rest as soon as the limits allow."""
        if self._is_upright:
            self._to_come = None
            x, y, z, self.yaw_rad = self._tool.brake()
            self.target_m = (x, y, z)
        else:
            self.target_m = self._kinematics.tcp(vec6(self._joints.brake()))

    def give_way(self, q_rad: Vec6) -> Vec6:
        """Go towards joints in one tick as hard as the limits let, and go on from there; return what to command."""
        self.trouble = self.held = None
        q = self._hold_back(q_rad, is_pushed=True)
        if self.held is None:
            self._go_on(q, self._commands.tcp_m)
        self._q_earlier_rad, self.q_before_rad, self.q_rad = self.q_before_rad, self.q_rad, q
        return q

    def step(self) -> Vec6:
        """Advance by one tick and return the joints to command."""
        self.trouble = self.held = None
        q = self._step_tool() if self._is_upright else self._hold_back(vec6(self._joints.step()))
        if self._tool.is_failed or self._joints.is_failed:
            self.trouble = "brake"
        self._q_earlier_rad, self.q_before_rad, self.q_rad = self.q_before_rad, self.q_rad, q
        return q

    def _step_tool(self) -> Vec6:
        if self._to_come is not None:
            self._take_target(self._to_come)
        tool, commands, reach = self._tool, self._commands, self._reach
        at = tool.at
        x, y, z, _ = at
        to = tool.step()
        u, v, w, yaw = to
        if reach is None or not self._lean.is_over or (to == at and self._is_solved):
            return self._hold_back(self._followed(at, to))
        is_free, q = upright_step(
            commands.rows, commands.newest, (x, y, z), (u, v, w), yaw, self._chain_rows, reach, self._bounds,
            self._envelope.joint_rows, self._envelope.fence_rows,
        )  # fmt: skip
        if not is_free:
            return self._hold_back(self._followed(at, to))
        commands.step()
        self._is_solved = True
        return q

    def _followed(self, before: list[float], now: list[float]) -> Vec6:
        """Return the joints of a tool that goes from a place to another, or where a fence leads it instead."""
        now = self._slide(before, now)
        lean = self._lean
        if now == before and self._is_solved and lean.is_over:
            return self.q_rad  # at rest: solving again would stir the last digits
        self._is_solved = True
        x, y, z, yaw = now
        ahead = between(self.q_before_rad, self.q_rad, 2.0)
        try:
            q = self._kinematics.solve((x, y, z), ahead, yaw_rad=yaw)
            return q if lean.is_over else lean.step(q)
        except UnreachableError:
            self._take_up_joints()
            self.brake()
            self.trouble = "unreachable"
            return vec6(self._joints.step())

    def _aim_tool(self, target: list[float]) -> None:
        """Go to a place and a turn, at guarded speed where it is low or leads low.

        A target goes at guarded speed there itself; a tool that trails it would catch up at full speed.
        """
        x, y, z, _ = self._tool.at
        at_m, to_m = (x, y, z), (target[0], target[1], target[2])
        is_slow = is_guarded(at_m, to_m, self._guard_z_m)
        slow = guarded_share(at_m, to_m, self._speed_m_s, self._guarded_m_s) if is_slow else 1.0
        self._tool.slow_to(min(slow, share_of_line(at_m, to_m, self._speed_m_s, self.most_m_s)))
        self._tool.aim(target)

    def _take_target(self, target: list[float]) -> None:
        if self._is_due:
            self._aim_tool(target)
            self._to_come = None
        self._is_due = True

    def _slide(self, before: list[float], now: list[float]) -> list[float]:
        """Lead the tool along a fence that it would come too near too fast."""
        x, y, z, yaw = now
        (sx, sy, sz), name = slid((before[0], before[1], before[2]), (x, y, z), self._envelope)
        if not name:
            return now
        self.held = name, math.dist((sx, sy, sz), (x, y, z)) / math.dist((x, y, z), before[:3])
        self._is_fenced = True
        dt, target, speed = self._tick_s, self._tool.target, self._tool.speed
        speed = [speed[0] + (sx - x) / dt, speed[1] + (sy - y) / dt, speed[2] + (sz - z) / dt, speed[3]]
        self._tool.seed([sx, sy, sz, yaw], speed)
        self._tool.aim(target)
        return self._tool.at

    def _hold_back(self, q: Vec6, *, is_pushed: bool = False) -> Vec6:
        """Hold a step back where joints would change their speeds too hard, or anything is too fast for what is ahead.

        It is brought back towards the step of an arm that brakes; motion goes on from there.
        """
        chain, now, envelope, ends = self._kinematics.chain, self.q_rad, self._envelope, self._envelope.joints
        commands, is_straight = self._commands, self._is_upright
        if free_step(
            commands.rows, commands.newest, q, self._chain_rows, self._bounds, envelope.joint_rows,
            envelope.fence_rows, is_straight,
        ):  # fmt: skip
            commands.step()
            return q
        points, here = chain.points(q), commands.place
        within = window(now, self.q_before_rad, self._q_earlier_rad, ends)
        wanted = [a - b for a, b in zip(q, now, strict=True)]
        share, name, base = 1.0, "", wanted
        if not all(map(le, within.low, wanted)) or not all(map(le, wanted, within.high)):
            base = braked(now, self.q_before_rad, self._q_earlier_rad, ends, within)
            share, name = part_way(wanted, base, within.low, within.high), "joint_acceleration"
        places = (commands.points_before, here, points)
        met = self._ahead.met(now, wanted, places, commands.past, is_straight=is_straight)
        if met:
            if base is wanted:
                base = braked(now, self.q_before_rad, self._q_earlier_rad, ends, within)
            left, blamed = self._ahead.left(met, now, here, wanted, base, is_straight=is_straight)
            if left < share:
                share, name = left, blamed
        if share < 1.0:
            self.held = name, 1.0 - share
            self._is_fenced = self._is_fenced or name in self._fence_names
            q = vec6([n + (b + share * (w - b)) for n, w, b in zip(now, wanted, base, strict=True)])
            points = chain.points(q)
            self._go_on(q, points[0][0], is_braking_kept=not is_pushed)
        commands.add(q, points)
        return q

    def _go_on(self, q: Vec6, tcp_m: Vec3, *, is_braking_kept: bool = False) -> None:
        """Let the limiter in charge go on from joints that are other than it said."""
        now, before = self.q_rad, self.q_before_rad
        if not self._is_upright:
            target = self._joints.target
            self._joints.go_on(list(before), list(now), list(q), is_braking_kept=is_braking_kept)
            self._joints.aim(target)
            return
        tool, quat = self._tool, self._kinematics.chain.quat
        target = tool.target
        yaws = [unwound(turn_about_vertical(quat(at)), target[3]) for at in (before, now, q)]
        places = (self._commands.points_before[0], self._commands.tcp_m, tcp_m)
        moves = ([*place, yaw] for place, yaw in zip(places, yaws, strict=True))
        tool.go_on(*moves, is_braking_kept=is_braking_kept)
        tool.aim(target)
        self._is_solved = False
        self._take_up_lean(q)

    def _take_up_tool(self) -> None:
        """Go on by the tool's coordinates, if it points down and the joints are at rest."""
        if max(abs(v) for v in self._joints.speed) > STILL_RAD_S:
            return
        quat = self._kinematics.chain.quat(self.q_rad)
        tilt = 2.0 * math.hypot(quat[0], quat[3])  # a tool that points straight down is turned by (0, x, y, 0)
        if tilt > ALIGN_RAD:
            return
        yaw = unwound(turn_about_vertical(quat), self._home_yaw_rad)
        if abs(yaw - self._home_yaw_rad) < ALIGN_RAD:
            yaw = self._home_yaw_rad
        self._is_upright, self._to_come = True, None
        self.target_m, self.yaw_rad = self._kinematics.tcp(self.q_rad), yaw
        self._tool.seed([*self.target_m, yaw])
        self._is_solved = False
        self._take_up_lean(self.q_rad)

    def _take_up_lean(self, q: Vec6) -> None:
        """Go on from joints that are other than an upright tool's there: bent by a push, or held back."""
        if not self._is_swift:
            return
        x, y, z, yaw = self._tool.at
        try:
            upright = self._kinematics.solve((x, y, z), q, yaw_rad=yaw)
        except UnreachableError:
            upright = None
        self._lean.begin(q, upright)

    def _take_up_joints(self) -> None:
        """Go on by the joints, from where they are and as fast as they go."""
        self._is_upright = False
        self._joints.slow_to(1.0)
        self._joints.go_on(list(self._q_earlier_rad), list(self.q_before_rad), list(self.q_rad))

    def _align(self, target_m: Vec3, yaw_rad: float) -> bool:
        """Bring the tool upright on the way to a place, by a bounded change of the joints."""
        now = vec6(self._joints.target)
        try:
            q = self._kinematics.solve(target_m, now, yaw_rad=yaw_rad)
        except UnreachableError:
            return False
        largest = max(abs(a - b) for a, b in zip(q, now, strict=True))
        self.aim_joints(between(now, q, min(1.0, ALIGN_STEP_RAD / largest)) if largest > 0.0 else q)
        self.yaw_rad = yaw_rad
        return True
