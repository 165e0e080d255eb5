"""Intents become joint set-points: shape, fence, guard by force, follow. State of one arm's motion."""

import math
from collections.abc import Sequence

from config.arm import ArmConfig
from robot.envelope import Envelope
from robot.geometry import inside_box
from robot.messages import ArmState, Heading, Intent, JointTarget, Limited, Twist, Vec3, Vec6
from robot.motion.approach import N_PIECES, Approach
from robot.motion.contact import ContactGuard
from robot.motion.follower import SWIFT_TICK_S, Follower
from robot.motion.guarding import dragged_speed
from robot.motion.holding import MARGIN_M, MARGIN_RAD, led_out, share_of_giving_way, share_of_way_back
from robot.motion.pieces import Pieces, padded, whole
from robot.motion.target import (
    MAX_TURN_RAD,
    Shaped,
    TargetLimits,
    advance_heading,
    advance_twist,
    fence,
    is_free,
)
from robot.motion.trail import Trail
from robot.safety import Block, StopCheck

__all__ = ["Mover"]

FOUND = True
"""What a way that is found says."""
JOINT_STEP_RAD = 0.35
"""Greatest change of any joint's target in one step."""
FENCE_MARGIN_M = 1e-4
"""How far inside a fence a command comes to rest that a push would carry past it."""
STRAY_M = 0.03
"""A tool this far from where its commands should have brought it is held up: the leash is held at the tool then."""
TINY_M = 1e-6
N_HALVINGS = 8
"""How finely a joint target that lies beyond a fence is brought back to it."""
RESEAT_SHARE = 0.9
"""Share of a joint's greatest speed at which commands fall back to the measured joints on contact."""


class Mover:
    """Carries the target from intent to intent. `seed` forgets everything before."""

    def __init__(
        self,
        arm: ArmConfig,
        *,
        envelope: Envelope,
        table_m: float,
        tick_s: float,
        approach: Approach | None = None,
        stops: StopCheck | None = None,
    ) -> None:
        """Put the parts together.

        Args:
            arm: the arm's file.
            envelope: what of the limits profile is held besides.
            table_m: height of the table's top, base frame.
            tick_s: how long a tick is.
            approach: what keeps targets clear of bodies and singular postures; None where there are none.
            stops: what looks at the stop after every step of the joints, farther from bodies than the gate's.
        """
        self._approach, self._stops = approach, stops
        self._limits = TargetLimits.of(arm, table_m)
        self._follower = Follower(
            arm, envelope=envelope, tick_s=tick_s, tip_min_m=self._limits.tip_min_m, guard_z_m=self._limits.guard_z_m
        )
        self._envelope = envelope
        self._contact, self._hard_n = ContactGuard(arm), arm.motion.hard_force_n
        self._contact_n, self._most_m_s = arm.motion.contact_force_n, envelope.part_step_m[0] / envelope.tick_s
        is_swift = tick_s < SWIFT_TICK_S
        self._trail = Trail(
            arm.servo, tick_s=tick_s, q_rad=self._follower.q_rad, n_ahead=N_PIECES + 1 if is_swift else 0
        )  # fmt: skip
        self._ranges = tuple(j.range_rad for j in arm.joints)
        self._fall_back_rad = tuple(RESEAT_SHARE * j.speed_rad_s * tick_s for j in arm.joints)
        self._amounts: dict[str, float] = {}
        self._least_s = 2 * N_PIECES * tick_s if is_swift else math.inf
        """In time steps shorter than this the way to a target is found at once."""
        self._way: Pieces[None] | None = None
        """How the way to a new target is found, while it is."""

    @property
    def target_m(self) -> Vec3:
        """Where the tool centre point will rest if nothing more is asked."""
        return self._follower.target_m

    @property
    def limiters(self) -> tuple[str, ...]:
        """What shortened or changed the present step so far, in order, each once."""
        return tuple(self._amounts)

    @property
    def limited(self) -> tuple[Limited, ...]:
        """The same, each with by how much."""
        return tuple(Limited(name=name, amount=amount) for name, amount in self._amounts.items())

    @property
    def is_in_contact(self) -> bool:
        """Whether something holds the tool up."""
        return self._contact.is_in_contact

    def seed(self, state: ArmState) -> None:
        """Rest at the measured joints and forget everything before."""
        self._follower.seed(state.q_rad)
        self._trail.seed(state.q_rad)
        self._contact.reset()
        self._amounts, self._way = {}, None
        if self._stops is not None:
            self._stops.seed()

    def surround(self, blocks: tuple[Block, ...]) -> None:
        """Keep the arm clear of these from now on, and come to rest where they stand in its way."""
        self._find_out()
        if self._stops is not None:
            self._stops.put(blocks)
        approach, follower = self._approach, self._follower
        if approach is None:
            return
        approach.put(blocks)
        if follower.is_upright and math.dist(follower.tcp(follower.q_rad), follower.target_m) > TINY_M:
            target_rad = follower.joints_at(follower.target_m)
            if target_rad is None or not approach.is_clear(follower.q_rad, target_rad):
                self._note("moved")
                follower.brake()

    def begin_step(self, intent: Intent, state: ArmState, *, duration_s: float) -> None:
        """Move the target as an intent asks for one time step. The gate has admitted the intent.

        In ticks as short as a real arm's the way to it is found piece by piece, always in as many ticks.
        """
        self._find_out()
        self._amounts = {}
        self._follower.let_go()
        self._follower.most_m_s = dragged_speed(state.tcp_force_n, self._contact_n, self._most_m_s)
        at, yaw = self._follower.target_m, self._follower.yaw_rad
        if isinstance(intent, Heading):
            self._follow(advance_heading(at, intent, self._limits, duration_s), yaw, state)
        elif isinstance(intent, Twist):
            turn = intent.angular_rad_s[2] * duration_s
            yaw += min(max(turn, -MAX_TURN_RAD), MAX_TURN_RAD)
            self._follow(advance_twist(at, intent, self._limits, duration_s), yaw, state)
        elif isinstance(intent, JointTarget):
            self._aim_joints(intent.q_rad, state, duration_s)
        else:
            self._follower.brake()
        if not (self._follower.is_upright and duration_s >= self._least_s):
            self._find_out()

    def wait_at(self, place_m: Vec3, state: ArmState) -> None:
        """Come to rest over a place in the plane that the tool has just passed: what the hand closes on lies there.

        A tool that is not upright rests where it can.
        """
        self._amounts, self._way = {"hand": 0.0}, None
        self._follower.brake()
        if self._follower.is_upright:
            shaped = Shaped((place_m[0], place_m[1], self._follower.target_m[2]))
            self._follow(shaped, self._follower.yaw_rad, state)
            self._find_out()

    def hold(self, because: str) -> None:
        """Come to rest in place of what an intent asks."""
        self._amounts, self._way = {because: 0.0}, None
        self._follower.brake()

    def tick(self, state: ArmState) -> Vec6:
        """Return the joints to command for this tick, eased by the measured force.

        Where the force says stop, the command goes back to the measured joints: they trail it by a lag that would go on
        pressing. It falls back at once if the push is hard, and by the joints' own accelerations if it is not.
        """
        follower = self._follower
        if not self._contact.is_free(state.tcp_force_n):
            commanded_m = follower.tcp(follower.q_rad)
            moved = self._contact.reseat(state.tcp_force_n, state.tcp_position_m, commanded_m, follower.target_m)
            if moved is not None:
                self._note("contact")
                if not self._contact.is_led_up(state.tcp_force_n, state.tcp_position_m, commanded_m, moved):
                    return self._give_way(moved, state)
                follower.aim(moved, follower.yaw_rad)
        if self._way is not None and next(self._way, FOUND) is FOUND:
            self._way = None
        before = follower.q_rad
        q = follower.step()
        if not follower.is_upright and q != before:
            self._brake_in_time(q, before, state)
        self._trail.add(q)
        if follower.trouble is not None:
            self._note(follower.trouble)
        if follower.held is not None:
            self._note(*follower.held)
        return q

    def _brake_in_time(self, q: Vec6, before: Vec6, state: ArmState) -> None:
        """Brake joints whose stop would come too near to a body: on the way to a new target they may leave the old way.

        An upright tool keeps to straight ways, which its targets were cleared for.
        """
        refusal = None if self._stops is None else self._stops.check(q, before, state)
        if refusal is not None:
            self._note("stop_ahead", refusal.amount)
            self._follower.brake()

    def _note(self, name: str, amount: float = 0.0) -> None:
        """Write down what changed the step, and by how much at most."""
        self._amounts[name] = max(self._amounts.get(name, 0.0), amount)

    def _give_way(self, target_m: Vec3, state: ArmState) -> Vec6:
        """Go back to the measured joints and aim at a target, but never let a push carry the command past a fence."""
        self._way, follower = None, self._follower
        yaw, back = follower.yaw_rad, self._back_to(state.q_rad)
        if not self._is_inside(back):
            back = self._back_inside(state)
        aim_m = fence(target_m, state.tcp_position_m, self._limits).position_m  # nearer to where it was
        if math.hypot(*state.tcp_force_n) <= self._hard_n:
            share = share_of_way_back(follower.q_rad, back, self._envelope)
            q = follower.give_way(
                _along(follower.q_rad, [b - a for a, b in zip(follower.q_rad, back, strict=True)], share)
            )
            self._trail.add(q)
            if follower.held is not None:
                self._note(*follower.held)
            follower.aim(aim_m, yaw)
            return q
        change = [b - a for a, b in zip(follower.q_rad, back, strict=True)]
        share = share_of_giving_way(follower.q_rad, follower.q_before_rad, back, state.q_rad, self._envelope)
        if share < 1.0:
            back = _along(follower.q_rad, change, share)
        follower.seed(back)
        self._trail.seed(back)
        follower.aim(aim_m, yaw)
        return back

    def _back_inside(self, state: ArmState) -> Vec6:
        """Return the command brought back to where the tool is, but for a fence that it was pushed past.

        A command that stayed where it was would go on pressing: at a fence the tool stood on a lid for good.
        """
        (x0, y0, z0), (x1, y1, z1) = self._limits.workspace_m
        (x, y, z), m = state.tcp_position_m, FENCE_MARGIN_M
        wanted = self._follower.joints_at(
            (min(max(x, x0 + m), x1 - m), min(max(y, y0 + m), y1 - m), min(max(z, z0 + m), z1 - m))
        )
        back = self._follower.q_rad if wanted is None else self._back_to(wanted)
        return back if self._is_inside(back) else self._follower.q_rad

    def _is_inside(self, q_rad: Vec6) -> bool:
        return inside_box(self._follower.tcp(q_rad), *self._limits.workspace_m) and self._beyond(q_rad) is None

    def _follow(self, shaped: Shaped, yaw_rad: float, state: ArmState) -> None:
        for name in shaped.limiters:
            self._note(name, shaped.amount_m)
        eased, is_eased = self._contact.ease(self._follower.target_m, shaped.position_m)
        if is_eased:
            self._note("contact", math.dist(eased, shaped.position_m))
        fenced = self._fenced(eased, state)
        for name in fenced.limiters:
            self._note(name, math.dist(fenced.position_m, eased))
        self._way = self._finding(fenced.position_m, yaw_rad)

    def _find_out(self) -> None:
        """Find the rest of the way to a new target at once."""
        way, self._way = self._way, None
        if way is not None:
            whole(way)

    def _finding(self, target_m: Vec3, yaw_rad: float) -> Pieces[None]:
        """Find the way to a target, and go there."""
        place_m = yield from padded(self._clearing(target_m, yaw_rad), N_PIECES)
        tilted_rad = None if self._follower.is_upright else self._follower.joint_target_rad
        if not self._follower.aim(place_m, yaw_rad):
            self._note("unreachable")
        elif tilted_rad is not None and not self._follower.is_upright:
            self._aim_clear(tilted_rad, self._follower.joint_target_rad)

    def _clearing(self, target_m: Vec3, yaw_rad: float) -> Pieces[Vec3]:
        """Keep the target of an upright tool from leading into bodies and singular postures."""
        follower, approach = self._follower, self._approach
        if approach is None or not follower.is_upright:
            return target_m
        at_m = follower.target_m
        place_m, because = yield from approach.clearing(
            at_m, target_m, now=lambda: follower.q_rad, joints_at=lambda p, seed: follower.joints_at(p, yaw_rad, seed)
        )
        if because is not None:
            self._note(because, math.dist(place_m, target_m))
        return place_m

    def _aim_clear(self, now: Vec6, wanted: Vec6) -> None:
        """Aim at joints, as far as the way there is clear of bodies."""
        if self._approach is not None:
            asked, (wanted, because) = wanted, self._approach.clear_joints(now, wanted)
            if because is not None:
                self._note(because, max(abs(a - b) for a, b in zip(asked, wanted, strict=True)))
        self._follower.aim_joints(wanted)

    def _aim_joints(self, wanted_rad: Vec6, state: ArmState, duration_s: float) -> None:
        """Move the joint target towards given joints, the tool by no more than a step and inside the fences."""
        limits, follower = self._limits, self._follower
        now = follower.joint_target_rad
        inside = [min(max(v, low), high) for v, (low, high) in zip(wanted_rad, self._ranges, strict=True)]
        if any(a != b for a, b in zip(inside, wanted_rad, strict=True)):
            self._note("joint_range", max(abs(a - b) for a, b in zip(inside, wanted_rad, strict=True)))
        here = follower.tcp(now)
        longest = limits.max_step_m if here[2] > limits.guard_z_m else limits.guarded_speed_m_s * duration_s
        change = [b - a for a, b in zip(now, inside, strict=True)]
        share = min(1.0, JOINT_STEP_RAD / max(1e-12, *(abs(c) for c in change)))
        q = _along(now, change, share)
        for _ in range(3):  # over one step the tool's path is nearly proportional to the joints'
            moved = math.dist(follower.tcp(q), here)
            if moved <= longest:
                break
            share *= 0.999 * longest / moved
            q = _along(now, change, share)
        if share < 1.0:
            self._note("max_step", 1.0 - share)
        tcp, lowest_m = follower.tcp_and_lowest(q)
        fenced = self._fenced(tcp, state)
        if fenced.limiters or lowest_m < limits.tip_min_m:
            for name in fenced.limiters or ("table",):
                self._note(name, math.dist(fenced.position_m, tcp))
            return
        self._aim_inside(now, q)

    def _aim_inside(self, now: Vec6, q: Vec6) -> None:
        """Aim at joints, or as near them as every part is inside of its fences and the tool inside of its cone."""
        beyond = self._beyond(q)
        if beyond is None:
            self._aim_clear(now, q)
            return
        self._note(*beyond)
        change, share, width = [b - a for a, b in zip(now, q, strict=True)], 0.0, 0.5
        for _ in range(N_HALVINGS):
            if self._beyond(_along(now, change, share + width)) is None:
                share += width
            width /= 2
        if share > 0.0:
            self._aim_clear(now, _along(now, change, share))

    def _beyond(self, q_rad: Vec6) -> tuple[str, float] | None:
        """Return which fence or cone joints would be beyond and by how much, None where all is inside."""
        points, down = self._follower.points(q_rad)
        for gap_of in self._envelope.fences:
            gap = gap_of.gap(points[gap_of.part]) - MARGIN_M
            if gap < 0.0:
                return gap_of.name, -gap
        over = self._envelope.cone_rad - MARGIN_RAD
        if over < math.pi and down < math.cos(over):
            return "tool_cone", math.cos(over) - down
        return None

    def _fenced(self, target_m: Vec3, state: ArmState) -> Shaped:
        """Keep a target inside the workspace and on the leash; where that is held is found only if it matters."""
        out_m, name = led_out(target_m, self._envelope)
        if not name and is_free(target_m, state.tcp_position_m, self._limits, stray_m=STRAY_M):
            return Shaped(target_m)
        fenced = fence(out_m, self._leashed_to_m(state), self._limits)
        return Shaped(fenced.position_m, (name, *fenced.limiters)) if name else fenced

    def _leashed_to_m(self, state: ArmState) -> Vec3:
        """Return where the leash is held: where a free tool is when it sets out, or the tool that is kept away."""
        free_m = self._follower.tcp(self._trail.q_rad)
        return free_m if math.dist(free_m, state.tcp_position_m) < STRAY_M else state.tcp_position_m

    def _back_to(self, measured_rad: Vec6) -> Vec6:
        """Return the command brought back to joints, the measured ones, as far as one tick allows."""
        now = self._follower.q_rad
        change = [b - a for a, b in zip(now, measured_rad, strict=True)]
        excess = max(abs(c) / most for c, most in zip(change, self._fall_back_rad, strict=True))
        return measured_rad if excess <= 1.0 else _along(now, change, 1.0 / excess)


def _along(a: Vec6, change: Sequence[float], share: float) -> Vec6:
    x = [u + share * v for u, v in zip(a, change, strict=True)]
    return x[0], x[1], x[2], x[3], x[4], x[5]
