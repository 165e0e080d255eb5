"""Targets are brought up to what the arm must keep clear of, and no nearer: bodies, and postures it cannot move in.

The tool always rests on its target without overshoot, so that a target that stays clear is a brake that comes in time:
nothing is slowed before it must be, and the arm stops at the limit, not a hand before it. Of a step only the part that
leads nearer is taken away, as much of it as there is no room for. So the step is a continuous function of the direction
asked for, and what leads away or along is done in full.
"""

import math
from collections.abc import Callable, Iterator, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig
from robot.chain import ToolChain
from robot.compiled import Table, compiled
from robot.geometry import vec6
from robot.messages import Vec3, Vec6
from robot.motion.pieces import Pieces, whole
from robot.safety import Block, Braking, Clearance

__all__ = ["N_PIECES", "Approach", "Margins", "Wall", "links_of", "singular_room", "yielding"]

Array = NDArray[np.float64]
Inverse = Callable[[Vec3, Vec6], Vec6 | None]
DAMPING = 1e-4
ROUNDS = 4
HALVINGS = 4
N_PIECES = 5
"""A target that is led past bodies is found in so many at the most, each as long as a tick may spare."""
N_REMEMBERED = 2
"""Postures of which rooms are known: where a step began, and where it leads."""
FAR_AHEAD_M, CORNER_M = 0.06, 0.02
"""A free tool trails its target by less; one that is held up may cut a corner, if a body is so near."""
TOLERANCE_M = 5e-4
"""What a step past a curved wall may lose of a margin."""
EASE = 1e-3
SHARE, SINGULAR_SHARE = 0.6, 0.25
"""Towards a singularity the joints go the faster the nearer it is: the tool is slowed sooner."""
"""A step beside a wall that is too near already leads away by as much."""
DIFFERENCE_RAD = 1e-6


Rooms = tuple[float, float, float, float]
"""What is left to the margins of bodies, elbow, wrist and shoulder."""


class Margins(msgspec.Struct, frozen=True, kw_only=True):
    """Where targets stop short of what the gate refuses."""

    clearance_m: float = 0.008
    """Beyond the distance that each pair keeps: what a stop at the worst may overrun, and bends of the way."""
    elbow: float = 0.3
    """Least sine of the elbow: stretched or folded flat the tool cannot go on along the arm."""
    wrist: float = 0.1
    """Least sine of wrist 2."""
    shoulder_m: float = 0.06
    """Least distance of wrist 2's centre from the upright plane through the base's axis."""


class Wall(msgspec.Struct, frozen=True):
    """Room left in one respect, and how it changes with the step."""

    name: str
    room: float
    slope: tuple[float, ...]
    share: float = 0.5
    """Of the room that is left no step takes more: the tool is slowed towards a wall while it begins to slide along."""


def yielding(step: Sequence[float], walls: Sequence[Wall]) -> tuple[list[float], str | None]:
    """Take from a step what leads nearer to walls than there is room for.

    Walls are met in turn a few times over; what is left of a corner between several is seen to by the caller.

    Returns:
        The step, unchanged where there is room, and the wall that took most of it.
    """
    left, blamed, most = list(step), None, 0.0
    for _ in range(ROUNDS):
        is_changed = False
        for wall in walls:
            size = sum(s * s for s in wall.slope)
            excess = -sum(s * x for s, x in zip(wall.slope, left, strict=True)) - (
                wall.share * wall.room if wall.room > 0.0 else max(wall.room, -EASE)
            )
            if excess > 0.0 < size:
                left = [x + excess / size * s for s, x in zip(wall.slope, left, strict=True)]
                is_changed = is_changed or excess > 1e-12
                if excess / math.sqrt(size) > most:
                    blamed, most = wall.name, excess / math.sqrt(size)
        if not is_changed:
            break
    return left, blamed


@compiled
def singular_room(links_m: Vec3, q: Vec6) -> Vec3:
    """Return the three factors of the tool's Jacobian determinant: sines of elbow and wrist 2, wrist 2's reach (m).

    det J of an arm with this offset geometry is proportional to their product; each is 0 at one singularity.

    Args:
        links_m: a of upper arm and forearm, d of wrist 2 (links_of).
        q: joints.
    """
    upper, fore, wrist = links_m
    q23 = q[1] + q[2]
    reach = upper * math.cos(q[1]) + fore * math.cos(q23) + wrist * math.sin(q23 + q[3])
    return abs(math.sin(q[2])), abs(math.sin(q[4])), abs(reach)


def links_of(arm: ArmConfig) -> Vec3:
    """Return what `singular_room` asks of an arm."""
    rows = arm.joints
    return rows[1].a_m, rows[2].a_m, rows[4].d_m


@compiled
def _turn_m(a: Vec6, b: Vec6, moved_m: float) -> float:
    """Return how far the fastest joint turns for a metre of the tool."""
    most = 0.0
    for u, v in zip(a, b):  # noqa: B905 - compiled: of one length by their types
        most = max(most, abs(u - v))
    return most / moved_m


@compiled
def _is_far(at: Rooms, there: Rooms, near_m: float) -> bool:
    """Return whether a step takes no more than its share of any room, or ends where bodies are out of sight.

    Args:
        at: rooms before it.
        there: and after it.
        near_m: bodies with more room than this are not looked at.
    """
    if there[0] < near_m and not there[0] >= at[0] * (1.0 - SHARE) >= 0.0:
        return False
    (_, a, b, c), (_, d, e, f), left = at, there, 1.0 - SINGULAR_SHARE
    return d >= a * left >= 0.0 and e >= b * left >= 0.0 and f >= c * left >= 0.0


@compiled
def _singular_slope(links_m: Vec3, q: Vec6, k: int) -> Vec6:
    """Return how the k-th of the factors changes with the joints: forward differences.  (3,), (6,), () -> (6,)"""
    here, h, (a, b, c, d, e, f) = singular_room(links_m, q)[k], DIFFERENCE_RAD, q
    return (
        (singular_room(links_m, (a + h, b, c, d, e, f))[k] - here) / h,
        (singular_room(links_m, (a, b + h, c, d, e, f))[k] - here) / h,
        (singular_room(links_m, (a, b, c + h, d, e, f))[k] - here) / h,
        (singular_room(links_m, (a, b, c, d + h, e, f))[k] - here) / h,
        (singular_room(links_m, (a, b, c, d, e + h, f))[k] - here) / h,
        (singular_room(links_m, (a, b, c, d, e, f + h))[k] - here) / h,
    )


@compiled
def _over_tool(slope: Vec6, J: Table) -> Vec3:
    """Return a slope over the joints as one over the tool's place, its turn kept.

    The first three of (J J^T + damping)^-1 J slope, by Cholesky's decomposition.  (6,), (6, 6) -> (3,)
    """
    lower, x = np.zeros((6, 6)), np.zeros(6)
    for i in range(6):
        for m in range(6):
            x[i] += J[i, m] * slope[m]
        for k in range(i + 1):
            total = DAMPING if i == k else 0.0
            for m in range(6):
                total += J[i, m] * J[k, m]
            for m in range(k):
                total -= lower[i, m] * lower[k, m]
            lower[i, k] = math.sqrt(total) if i == k else total / lower[k, k]
    for i in range(6):
        for m in range(i):
            x[i] -= lower[i, m] * x[m]
        x[i] /= lower[i, i]
    for back in range(6):
        i = 5 - back
        for m in range(i + 1, 6):
            x[i] -= lower[m, i] * x[m]
        x[i] /= lower[i, i]
    return x[0], x[1], x[2]


class Approach:
    """Steps of the target of one arm at one table."""

    def __init__(
        self, arm: ArmConfig, clearance: Clearance, *, braking: Braking, margins: Margins | None = None
    ) -> None:
        self._clearance = clearance
        self._speed_m_s, self._braking_m_s2 = arm.motion.speed_m_s, arm.motion.acceleration_m_s2
        self._chain = ToolChain(arm)
        self._workspace_m = arm.motion.workspace_m
        self._stop_rad_s2 = braking.least_rad_s2
        self._at_m: Vec3 | None = None
        self._q: Vec6 | None = None
        self._rooms_of: dict[Vec6, Rooms] = {}
        """Of the joints asked about last, the newest last."""
        self._room_m = 0.0
        """The newest one's of bodies."""
        self._links_m = links_of(arm)
        self._margins = margins or Margins()
        self._near_m = clearance.most_m - self._margins.clearance_m
        self._least = (self._margins.elbow, self._margins.wrist, self._margins.shoulder_m)

    def put(self, blocks: tuple[Block, ...]) -> None:
        """Take things to be where they are now."""
        self._clearance.put(blocks)
        self._rooms_of.clear()

    def is_clear(self, now_rad: Vec6, target_rad: Vec6) -> bool:
        """Whether the way between joints keeps its margins, as far as the joints it begins at do."""
        floor_m = min(self._margins.clearance_m, self._clearance.gap(now_rad)) - TOLERANCE_M
        return self._is_way_clear(now_rad, target_rad, floor_m)

    def clear_place(self, at_m: Vec3, target_m: Vec3, *, now_rad: Vec6, joints_at: Inverse) -> tuple[Vec3, str | None]:
        """Return a target as near to the one asked for as stays clear, and what kept it away.

        Args:
            at_m: the target before.
            target_m: the target asked for.
            now_rad: the joints commanded by now.
            joints_at: the joints that bring the tool to a place, near others.
        """
        return whole(self.clearing(at_m, target_m, now=lambda: now_rad, joints_at=joints_at))

    def clearing(
        self, at_m: Vec3, target_m: Vec3, *, now: Callable[[], Vec6], joints_at: Inverse
    ) -> Pieces[tuple[Vec3, str | None]]:
        """Do the same piece by piece, N_PIECES at the most; `now` returns the joints commanded by then."""
        if target_m == at_m:
            return target_m, None
        q_at = self._q if at_m == self._at_m else joints_at(at_m, now())
        if q_at is None:
            q_at = now()
            at_m = self._chain.tcp(q_at)
        q = joints_at(target_m, q_at)
        overrun_m = 0.0 if q is None else self._overrun_m(q_at, q, math.dist(at_m, target_m))
        yield
        if q is not None and overrun_m == 0.0 and _is_far(self._rooms(q_at), self._rooms(q), self._near_m):
            place_m, because = self._take(target_m, q), None
        else:
            yield
            place_m, because = yield from self._yield(at_m, target_m, q_at, overrun_m, joints_at)
        yield
        return self._uncut(place_m, because, now(), joints_at)

    def _uncut(self, place_m: Vec3, because: str | None, now_rad: Vec6, joints_at: Inverse) -> tuple[Vec3, str | None]:
        """Draw a target that runs far ahead of a tool near a body to the tool's own side of it: no corner is cut."""
        now_m = self._chain.tcp(now_rad)
        is_far_ahead = math.dist(place_m, now_m) >= FAR_AHEAD_M
        if not is_far_ahead and self._room_m > CORNER_M:
            return place_m, because
        if self._clearance.gap(now_rad) > (CORNER_M if is_far_ahead else self._margins.clearance_m - TOLERANCE_M):
            return place_m, because
        ahead = [b - a for a, b in zip(now_m, place_m, strict=True)]
        J = self._clearance.tool_jacobian(now_rad)
        margin_m = self._margins.clearance_m
        walls = [
            Wall(w.name, w.room, _over_tool(vec6(w.slope), J), 1.0)
            for w in self._bodies(now_rad, margin_m, _length(ahead))
        ]
        left, blamed = yielding(ahead, walls)
        if blamed is None:
            return place_m, because
        place_m = (now_m[0] + left[0], now_m[1] + left[1], now_m[2] + left[2])
        q = joints_at(place_m, now_rad)
        return (now_m if q is None else self._take(place_m, q)), blamed

    def _take(self, place_m: Vec3, q: Vec6) -> Vec3:
        self._at_m, self._q = place_m, q
        return place_m

    def _rooms(self, q: Vec6) -> Rooms:
        """Return what is left to each margin."""
        rooms = self._rooms_of.pop(q, None)
        if rooms is None:
            elbow, wrist, shoulder_m = singular_room(self._links_m, q)
            a, b, c = self._least
            room_m = self._clearance.gap(q) - self._margins.clearance_m
            rooms = room_m, elbow - a, wrist - b, shoulder_m - c
            if len(self._rooms_of) == N_REMEMBERED:
                del self._rooms_of[next(iter(self._rooms_of))]
        self._rooms_of[q], self._room_m = rooms, rooms[0]
        return rooms

    def _overrun_m(self, a: Vec6, b: Vec6, moved_m: float) -> float:
        """Return how much farther than motion's own braking a stop at the worst may carry the tool here.

        Motion brakes the tool at its acceleration, a stop the fastest joint at its own: where a joint turns far for a
        small way of the tool, as over the base, a stop takes longer.
        """
        turn_rad_m = _turn_m(a, b, moved_m)
        return max(0.0, self._speed_m_s**2 / 2.0 * (turn_rad_m / self._stop_rad_s2 - 1.0 / self._braking_m_s2))

    def _yield(
        self, at_m: Vec3, target_m: Vec3, q_at: Vec6, overrun_m: float, joints_at: Inverse
    ) -> Pieces[tuple[Vec3, str | None]]:
        step = [b - a for a, b in zip(at_m, target_m, strict=True)]
        J = self._clearance.tool_jacobian(q_at)
        margin_m = self._margins.clearance_m + overrun_m
        bodies = [*self._bodies(q_at, margin_m, _length(step))]
        yield
        walls = [Wall(w.name, w.room, _over_tool(vec6(w.slope), J), w.share) for w in (*bodies, *self._singular(q_at))]
        walls += self._fences(at_m, overrun_m)
        left, blamed = yielding(step, walls)
        yield
        for _ in range(HALVINGS):
            place = (at_m[0] + left[0], at_m[1] + left[1], at_m[2] + left[2])
            q = joints_at(place, q_at)
            if q is not None and self._is_no_worse(q_at, q, overrun_m):
                return self._take(place, q), blamed
            left = [0.5 * x for x in left]
        return at_m, blamed or "clearance"

    def _fences(self, at_m: Vec3, overrun_m: float) -> Iterator[Wall]:
        if overrun_m > 0.0:
            for i, (x, low, high) in enumerate(zip(at_m, *self._workspace_m, strict=True)):
                slope = [0.0, 0.0, 0.0]
                slope[i] = 1.0
                yield Wall("workspace", x - low - overrun_m, tuple(slope))
                yield Wall("workspace", high - x - overrun_m, tuple(-s for s in slope))

    def clear_joints(self, q_at: Vec6, wanted: Vec6) -> tuple[Vec6, str | None]:
        """Return joints as near to those asked for as stay clear, the way there too, and what kept them away."""
        margin = self._margins.clearance_m
        if self._is_way_clear(q_at, wanted, margin):
            return wanted, None
        step = [b - a for a, b in zip(q_at, wanted, strict=True)]
        left, blamed = yielding(step, list(self._bodies(q_at, margin, _length(step))))
        floor = min(margin, self._clearance.gap(q_at))
        for _ in range(HALVINGS):
            there = vec6([a + s for a, s in zip(q_at, left, strict=True)])
            if self._is_way_clear(q_at, there, floor - 1e-4):
                return there, blamed
            left = [0.5 * x for x in left]
        return q_at, blamed or "clearance"

    def _is_way_clear(self, a: Vec6, b: Vec6, margin: float) -> bool:
        gap = self._clearance.gap
        return all(gap(vec6([u + k / 4 * (v - u) for u, v in zip(a, b, strict=True)])) >= margin for k in (4, 3, 2, 1))

    def _bodies(self, q: Vec6, margin_m: float, far: float) -> Iterator[Wall]:
        """Yield what is near, its room and its slope over the joints."""
        for c in self._clearance.closest(q, within_m=margin_m + 3.0 * far):
            yield Wall("clearance", c.gap_m - margin_m, c.slope_m_rad, SHARE)

    def _singular(self, q: Vec6) -> Iterator[Wall]:
        here = singular_room(self._links_m, q)
        for k, (room, least) in enumerate(zip(here, self._least, strict=True)):
            if room < 4.0 * least:
                yield Wall("singularity", room - least, _singular_slope(self._links_m, q, k), SINGULAR_SHARE)

    def _is_no_worse(self, q_at: Vec6, q: Vec6, extra_m: float) -> bool:
        """Whether a place keeps the margins, or what the one before had of them where that is less."""
        extra = (extra_m, 0.0, 0.0, 0.0)
        rooms = zip(self._rooms(q_at), self._rooms(q), extra, strict=True)
        return all(there - e >= min(here - e, -TOLERANCE_M) for here, there, e in [*rooms])


def _length(step: Sequence[float]) -> float:
    return math.sqrt(sum(x * x for x in step))
