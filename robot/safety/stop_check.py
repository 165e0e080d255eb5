"""Whether the arm could be stopped after a command before it leaves its limits or comes too near to anything."""

import numpy as np

from config.arm import ArmConfig
from robot.chain import ToolChain, chain_points, lowest_fingertip
from robot.compiled import Table, compiled
from robot.envelope import Envelope
from robot.fences import least_gap
from robot.geometry import between, difference, stepped
from robot.messages import ArmState, Box3, Vec3, Vec6
from robot.safety.blocks import Block
from robot.safety.checks import Reason, Refusal
from robot.safety.clearance import Clearance
from robot.safety.cover import N_SEEN, covered_share, nothing_seen
from robot.safety.limits import GateLimits
from robot.safety.stopping import Braking
from robot.safety.sweep import Links, Sweep, swept_m

__all__ = ["StopCheck", "looked_ahead"]

FINE_M = 0.001
"""Ways shorter than this hide nothing between their ends."""
TINY_M = 1e-6
OVERRUN_M = 0.003
"""How far a stop may overrun the fences: less than the fingertips' least height over the table."""
HALFWAY = 0.5
"""Of the way to a stop's end: there too an arm that goes along a fence must be inside of it, for its way bends."""

NO_FENCES: Table = np.empty((0, 9))
MOST_LOOKS = 5
"""A way that is not proved free by so many new gaps leads near to something, and is looked at closely."""
STRIDE = 0.95
"""Of the farthest gap that is told: so far beyond what is proved the next gap is asked for."""

Pair = tuple[float, float]
Known = Pair
"""Bounds where the last command led: how far all parts are inside their fences, every joint its range."""


@compiled
def looked_ahead(
    q_rad: Vec6, before_rad: Vec6, known: Known, seen: Table, far_m: Vec6, links_m: Links, law: Pair
) -> tuple[Known, bool, float, Vec6, float]:
    """Return what a command leads to when the arm is stopped after it, braking at the worst.

    Args:
        q_rad: the command.
        before_rad: the one before.
        known: what was known there.
        seen: gaps that were found lately (cover).
        far_m: reaches of Sweep.
        links_m: the rest of them.
        law: a stop turns a joint on by its step times the fastest joint's step times the first; and before that it
            goes on for so many ticks.

    Returns:
        What is known at the command; whether a limit may be near; what share of the way to where the arm comes to rest
        is free of bodies for sure (covered_share), where that is, and how far no point of it goes until then.
    """
    step = difference(q_rad, before_rad)
    fastest = 0.0
    for s in step:
        fastest = max(fastest, abs(s))
    stretch, lead = law
    moved_m = swept_m(step, far_m, links_m)
    fence_m, range_rad = known[0] - moved_m, known[1] - fastest
    share = fastest * stretch + lead
    is_limit_near = not (fence_m > moved_m * share and range_rad > fastest * share)
    ahead_m, end = moved_m * share, stepped(q_rad, step, share)
    covered = covered_share(q_rad, end, ahead_m, seen, far_m, links_m)
    return (fence_m, range_rad), is_limit_near, covered, end, ahead_m


@compiled
def _fence_room(tcp_m: Vec3, lowest_m: float, workspace_m: Box3, tip_min_m: float) -> float:
    (x, y, z), (low, high) = tcp_m, workspace_m
    room = min(x - low[0], high[0] - x, y - low[1], high[1] - y)
    return min(room, z - low[2], high[2] - z, lowest_m - tip_min_m)


@compiled
def _range_room(q: Vec6, low: Vec6, high: Vec6) -> float:
    room = q[0] - low[0]
    for at, least, most in zip(q, low, high):  # noqa: B905 - compiled: of one length by their types
        room = min(room, at - least, most - at)
    return room


@compiled
def _room(q: Vec6, workspace_m: Box3, tips_m: Vec3, rows: Table, tool_m: tuple[Vec3, Vec3], fences: Table) -> float:
    """Return how far all that is fenced in is inside.

    Args:
        q: joints.
        workspace_m: where the tool centre point may be.
        tips_m: least height of a fingertip, and ToolChain's tip and finger.
        rows: the chain's.
        tool_m: tool centre point and elbow of ToolChain.
        fences: the envelope's.
    """
    tip_min_m, tip_m, finger_m = tips_m
    points, down = chain_points(q, rows, tool_m[0], tool_m[1])
    room_m = _fence_room(points[0], lowest_fingertip(points[0], down, tip_m, finger_m), workspace_m, tip_min_m)
    return min(room_m, least_gap(fences, points))


@compiled
def _stayed_inside(
    q: Vec6,
    end: Vec6,
    range_rad: tuple[Vec6, Vec6],
    workspace_m: Box3,
    tips_m: Vec3,
    rows: Table,
    tool_m: tuple[Vec3, Vec3],
    fences: Table,
) -> tuple[bool, float, float]:
    """Return whether a stop keeps inside the limits, and how far inside its fences and ranges the command itself is.

    Args:
        q: the command.
        end: where the stop ends.
        range_rad: least and greatest angles.
        workspace_m: as of _room, like all that follows.
        tips_m: likewise.
        rows: likewise.
        tool_m: likewise.
        fences: likewise.
    """
    low, high = range_rad
    rest_m = min(
        _room(end, workspace_m, tips_m, rows, tool_m, fences),
        _room(between(q, end, HALFWAY), workspace_m, tips_m, rows, tool_m, fences),
    )
    is_inside = _range_room(end, low, high) >= 0.0 and rest_m >= -OVERRUN_M
    return is_inside, _room(q, workspace_m, tips_m, rows, tool_m, fences), _range_room(q, low, high)


class StopCheck:
    """The stopping trajectory of every command, verified. Memory: the gaps found last, and how far limits were.

    Nothing of the arm moves farther than the joints' turns times their reaches, so that a gap found at one posture is
    a bound on the gaps near it, and most ticks need no evaluation, nearly all others one. Angles and fences are
    asked of where the arm comes to rest, fences halfway too, bodies of the whole way there: braking at its worst.

    Attributes:
        known: (1, 2) where the last command led all parts are so far inside their fences at least, and every joint so
            far inside its range.
        seen: The gaps that were found last (cover).
        law: (2, 6) the sweep's reaches; its links, and how a stop brakes.
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
        envelope: Envelope | None = None,
    ) -> None:
        """Put the parts together.

        Args:
            arm: the arm's file.
            clearance: distances, with what each pair keeps.
            limits: where a stop may end.
            tick_s: how long each command holds.
            braking: how hard a stop brakes.
            lead_s: how long the arm goes on before it brakes.
            envelope: whose fences a stop keeps inside of besides; None where there are none.
        """
        self._clearance, self._limits, self._tick_s = clearance, limits, tick_s
        self._chain = ToolChain(arm)
        self._sweep = Sweep(arm)
        self._fences = () if envelope is None else envelope.fences
        self._fence_rows = NO_FENCES if envelope is None else envelope.fence_rows
        self._law = (1.0 / (2.0 * tick_s * tick_s * braking.least_rad_s2), lead_s / tick_s)
        sweep = self._sweep
        self.law: Table = np.array([sweep.far_m, (*sweep.links_m, *self._law, 0.0, 0.0)])
        self.known: Table = np.zeros((1, 2))
        self.seed()

    def seed(self) -> None:
        """Forget what was found: the next command is looked at afresh."""
        self.known[:] = 0.0
        self.seen, self._n_seen = nothing_seen(), 0
        self._at: Vec6 | None = None
        """Where the last command led that was looked at."""

    def put(self, blocks: tuple[Block, ...]) -> None:
        """Take things to be where they are now: what was found of gaps holds no more."""
        self._clearance.put(blocks)
        self.seen = nothing_seen()

    def follows(self, before_rad: Vec6) -> bool:
        """Return whether what is known holds for the command after these joints."""
        return before_rad == self._at

    def note(self, q_rad: Vec6) -> None:
        """Take note of a command whose stop somebody else has found free, and kept `known` up."""
        self._at = q_rad

    def check(self, q_rad: Vec6, before_rad: Vec6, state: ArmState) -> Refusal | None:
        """Refuse joints from which a stop would end outside the limits or pass too near to something.

        Args:
            q_rad: the command, that differs from the one before.
            before_rad: the command before.
            state: what the arm measured. A command that falls back towards it, as motion lets it in contact, drives
                the arm no faster than it goes.
        """
        if before_rad != self._at:
            self.seed()  # commands came between that nobody asked about
        self._at = q_rad
        refusal = self._check_step(q_rad, before_rad, before_rad)
        if refusal is not None and self._is_falling_back(q_rad, before_rad, state.q_rad):
            return self._check_step(q_rad, before_rad, stepped(q_rad, state.qd_rad_s, -self._tick_s))
        return refusal

    def _is_falling_back(self, q: Vec6, before: Vec6, measured: Vec6) -> bool:
        sweep = self._sweep
        return sweep.bound_m(difference(q, measured)) < sweep.bound_m(difference(before, measured))

    def _check_step(self, q_rad: Vec6, before_rad: Vec6, from_rad: Vec6) -> Refusal | None:
        """Look at the stop of a command that is as fast as if it came from some joints in one tick."""
        sweep = self._sweep
        fence_m, range_rad = self.known[0].tolist()
        known, is_limit_near, covered, end, ahead_m = looked_ahead(
            q_rad, from_rad, (fence_m, range_rad), self.seen, sweep.far_m, sweep.links_m, self._law
        )
        self.known[0] = known
        if is_limit_near:
            refusal = self._check_limits(q_rad, end)
            if refusal is not None:
                return refusal
        if covered > 1.0 or self._is_free(q_rad, end, ahead_m, covered):
            return None
        return self._check_way(q_rad, end, self._gap(end), ahead_m, before_rad)

    def _is_free(self, q: Vec6, end: Vec6, length_m: float, covered: float) -> bool:
        """Return whether few gaps more prove a way free, each asked for beyond what is proved already."""
        sweep, stride = self._sweep, STRIDE * self._clearance.most_m / length_m if length_m > 0.0 else 1.0
        for _ in range(MOST_LOOKS):
            share, before = min(1.0, covered + stride), covered
            if self._gap(between(q, end, share)) <= 0.0:
                return False
            covered = covered_share(q, end, length_m, self.seen, sweep.far_m, sweep.links_m)
            if covered > 1.0:
                return True
            if covered <= before:
                stride /= 2.0
        return False

    def _gap(self, q: Vec6) -> float:
        """Return the gap at joints, and remember it."""
        gap_m = self._clearance.gap(q)
        self.seen[self._n_seen % N_SEEN] = (*q, gap_m)
        self._n_seen += 1
        return gap_m

    def _check_limits(self, q: Vec6, end: Vec6) -> Refusal | None:
        """Look at where the arm comes to rest, and take note of how far inside its limits the command is."""
        limits, chain = self._limits, self._chain
        low_rad, high_rad = limits.q_min_rad, limits.q_max_rad
        is_inside, *known = _stayed_inside(
            q, end, (low_rad, high_rad), limits.workspace_m, (limits.tip_min_m, chain.tip_m, chain.finger_m),
            chain.rows, (chain.tcp_m, chain.elbow_m), self._fence_rows,
        )  # fmt: skip
        self.known[0] = known
        if is_inside:
            return None
        if not _range_room(end, low_rad, high_rad) >= 0.0:
            return Refusal(
                Reason.STOP_RANGE, f"expected a stop within the joints' ranges, it would end at {_round(end)}"
            )
        return self._overrun(end) or self._overrun(between(q, end, HALFWAY))

    def _overrun(self, at: Vec6) -> Refusal | None:
        """Say which fence a stop would overrun, and by how much; None where none."""
        limits, chain = self._limits, self._chain
        tcp, lowest_m = chain.tcp_and_lowest(at)
        over_m = -_fence_room(tcp, lowest_m, limits.workspace_m, limits.tip_min_m) - OVERRUN_M
        if over_m > 0.0:
            low, high = limits.workspace_m
            detail = (
                f"expected a stop inside {low} to {high} m with the fingertips at {limits.tip_min_m:g} m or higher, "
                f"it would come to {_round(tcp)} with them at {lowest_m:.4f}"
            )
            return Refusal(Reason.STOP_WORKSPACE, detail, over_m)
        points = chain.points(at)[0]
        for fence in self._fences:
            over_m = -fence.gap(points[fence.part]) - OVERRUN_M
            if over_m > 0.0:
                detail = f"expected a stop inside {fence.name}, it would come {over_m + OVERRUN_M:.4f} m beyond"
                return Refusal(Reason.STOP_WORKSPACE, detail, over_m)
        return None

    def _check_way(self, q: Vec6, end: Vec6, end_gap_m: float, length_m: float, before: Vec6) -> Refusal | None:
        """Look closely: at the command and then between, until bounds meet. What is too near already may part."""
        gap = self._gap
        here_m = gap(q)
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
                middle = between(a, b, 0.5)
                gap_m = gap(middle)
                spans += [(a, gap_a, middle, gap_m, long_m / 2.0), (middle, gap_m, b, gap_b, long_m / 2.0)]
        return None

    def _too_near(self, q: Vec6, gap_m: float) -> Refusal:
        found = self._clearance.closest(q, within_m=gap_m + FINE_M)
        who = min(found, key=lambda c: c.gap_m).pair if found else None
        what = "bodies apart" if who is None else f"{who.part} clear of {who.other}"
        detail = f"expected {what} on the way to a stop, it would be {-gap_m:.4f} m too near"
        return Refusal(Reason.CLEARANCE, detail, -gap_m)


def _round(values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(round(x, 4) for x in values)
