"""Whether the arm could be stopped after a command before it leaves its limits or comes too near to anything."""

from operator import le

from config.arm import ArmConfig
from robot.kinematics import ToolChain
from robot.messages import ArmState, Vec3, Vec6
from robot.safety.blocks import Block
from robot.safety.checks import Reason, Refusal
from robot.safety.clearance import Clearance
from robot.safety.limits import GateLimits
from robot.safety.stopping import Braking
from robot.safety.sweep import Sweep

__all__ = ["StopCheck"]

FINE_M = 0.001
"""Ways shorter than this hide nothing between their ends."""
TINY_M = 1e-6
OVERRUN_M = 0.003
"""How far a stop may overrun the fences: less than the fingertips' least height over the table."""


class StopCheck:
    """The stopping trajectory of every command, verified. Memory: a bound on the gap where the last command led.

    Nothing of the arm moves farther than the joints' turns times their reaches, so that a gap found at one posture is
    a bound on the gaps near it, and most ticks need one evaluation at most. Angles and workspace are asked of where
    the arm comes to rest, bodies of the whole way there, braking at its worst.
    """

    def __init__(
        self,
        arm: ArmConfig,
        clearance: Clearance,
        *,
        limits: GateLimits,
        tick_s: float,
        braking: Braking,
        lead_s: float = 0.0,
    ) -> None:
        """Put the parts together.

        Args:
            arm: the arm's file.
            clearance: distances, with what each pair keeps.
            limits: where a stop may end.
            tick_s: how long each command holds.
            braking: how hard a stop brakes.
            lead_s: how long the arm goes on before it brakes.
        """
        self._clearance, self._limits, self._tick_s = clearance, limits, tick_s
        self._chain = ToolChain(arm)
        self._sweep = Sweep(arm)
        # A stop turns a joint on by its step times the fastest joint's step times this.
        self._stretch = 1.0 / (2.0 * tick_s * tick_s * braking.deceleration_rad_s2)
        self._weaker = 1.0 / braking.least_share
        self._lead = lead_s / tick_s
        self.seed()

    def seed(self) -> None:
        """Forget what was found: the next command is looked at afresh."""
        self._room_m = 0.0
        """The gap is at least this where the last command led, the tool so far inside its fences,"""
        self._fence_m = 0.0
        self._range_rad = 0.0
        """and every joint so far inside its range."""

    def put(self, blocks: tuple[Block, ...]) -> None:
        """Take things to be where they are now: what was found of gaps holds no more."""
        self._clearance.put(blocks)
        self._room_m = 0.0

    def check(self, q_rad: Vec6, before_rad: Vec6, state: ArmState) -> Refusal | None:
        """Refuse joints from which a stop would end outside the limits or pass too near to something.

        Args:
            q_rad: the command, that differs from the one before.
            before_rad: the command before.
            state: what the arm measured. A command that falls back towards it, as motion lets it in contact, drives
                the arm no faster than it goes.
        """
        step = [a - b for a, b in zip(q_rad, before_rad, strict=True)]
        refusal = self._check_step(q_rad, before_rad, step)
        if refusal is not None and self._is_falling_back(q_rad, before_rad, state.q_rad):
            return self._check_step(q_rad, before_rad, [v * self._tick_s for v in state.qd_rad_s])
        return refusal

    def _is_falling_back(self, q: Vec6, before: Vec6, measured: Vec6) -> bool:
        now, then = ([a - b for a, b in zip(x, measured, strict=True)] for x in (q, before))
        return self._sweep.bound_m(now) < self._sweep.bound_m(then)

    def _check_step(self, q_rad: Vec6, before_rad: Vec6, step: list[float]) -> Refusal | None:
        fastest = max(max(step), -min(step))
        moved_m = self._sweep.bound_m(step)
        share = fastest * self._stretch + self._lead
        self._room_m -= moved_m
        self._fence_m -= moved_m
        self._range_rad -= fastest
        if self._fence_m <= moved_m * share or self._range_rad <= fastest * share:
            refusal = self._check_limits(q_rad, _along(q_rad, step, share))
            if refusal is not None:
                return refusal
        share = fastest * self._stretch * self._weaker + self._lead
        ahead_m = moved_m * share
        if self._room_m > ahead_m:
            return None
        end = _along(q_rad, step, share)
        least_m = self._clearance.gap(end)
        self._room_m = least_m - ahead_m
        if self._room_m > 0.0:
            return None
        return self._check_way(q_rad, end, least_m, ahead_m, before_rad)

    def _check_limits(self, q: Vec6, end: Vec6) -> Refusal | None:
        """Look at where the arm comes to rest, and take note of how far inside its limits the command is."""
        limits = self._limits
        low_rad, high_rad = limits.q_min_rad, limits.q_max_rad
        if not (all(map(le, low_rad, end)) and all(map(le, end, high_rad))):
            return Refusal(
                Reason.STOP_RANGE, f"expected a stop within the joints' ranges, it would end at {_round(end)}"
            )
        inside_m, tcp, lowest_m = self._inside(end)
        if not inside_m >= -OVERRUN_M:
            low, high = limits.workspace_m
            detail = (
                f"expected a stop inside {low} to {high} m with the fingertips at {limits.tip_min_m:g} m or higher, "
                f"it would end at {_round(tcp)} with them at {lowest_m:.4f}"
            )
            return Refusal(Reason.STOP_WORKSPACE, detail, -inside_m - OVERRUN_M)
        self._fence_m = self._inside(q)[0]
        self._range_rad = min([min(x - a, b - x) for a, x, b in zip(low_rad, q, high_rad, strict=True)])
        return None

    def _inside(self, q: Vec6) -> tuple[float, Vec3, float]:
        """Return how far inside its fences the tool is, where it is, and how high its lowest fingertip."""
        (x0, y0, z0), (x1, y1, z1) = self._limits.workspace_m
        (tcp, _, _), down = self._chain.points(q)
        lowest_m = self._chain.lowest_m(tcp, down)
        x, y, z = tcp
        inside_m = min(x - x0, x1 - x, y - y0, y1 - y, z - z0, z1 - z, lowest_m - self._limits.tip_min_m)
        return inside_m, tcp, lowest_m

    def _check_way(self, q: Vec6, end: Vec6, end_gap_m: float, length_m: float, before: Vec6) -> Refusal | None:
        """Look closely: at the command and then between, until bounds meet. What is too near already may part."""
        gap = self._clearance.gap
        here_m = gap(q)
        self._room_m = here_m
        floor_m = 0.0
        if here_m < 0.0 or end_gap_m < 0.0:
            floor_m = min(0.0, gap(before) - TINY_M)
        spans = [(q, here_m, end, end_gap_m, length_m)]
        while spans:
            a, gap_a, b, gap_b, long_m = spans.pop()
            least_m = min(gap_a, gap_b)
            if least_m < floor_m:
                return self._too_near(a if gap_a < gap_b else b, least_m)
            if gap_a + gap_b - long_m < 2.0 * floor_m and long_m > FINE_M:
                middle = _between(a, b)
                gap_m = gap(middle)
                spans += [(a, gap_a, middle, gap_m, long_m / 2.0), (middle, gap_m, b, gap_b, long_m / 2.0)]
        return None

    def _too_near(self, q: Vec6, gap_m: float) -> Refusal:
        found = self._clearance.closest(q, within_m=gap_m + FINE_M)
        who = min(found, key=lambda c: c.gap_m).pair if found else None
        what = "bodies apart" if who is None else f"{who.part} clear of {who.other}"
        detail = f"expected {what} on the way to a stop, it would be {-gap_m:.4f} m too near"
        return Refusal(Reason.CLEARANCE, detail, -gap_m)


def _along(q: Vec6, step: list[float], share: float) -> Vec6:
    a, b, c, d, e, f = [x + share * s for x, s in zip(q, step, strict=True)]
    return a, b, c, d, e, f


def _between(a: Vec6, b: Vec6) -> Vec6:
    x = [(u + v) / 2.0 for u, v in zip(a, b, strict=True)]
    return x[0], x[1], x[2], x[3], x[4], x[5]


def _round(values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(round(x, 4) for x in values)
