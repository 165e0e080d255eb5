"""What an arm's own measurement says of one probe: how far, how fast, off its line, when at rest. Pure."""

from collections.abc import Callable, Iterator, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.limits import Stopping
from robot.bench import BenchResult
from robot.hal.sight import Sight
from robot.messages import Vec3
from robot.teleop.probes import MOST_M_S, TURN_RAD, UNDER_WAY_M, WALL_M, WAY_M, WRIST, Kind, Probe

__all__ = ["RAMP_S", "Carried", "Marks", "judge_probe"]

Array = NDArray[np.float64]
WAY_OFF_M, LINE_OFF_M, BACK_OFF_M, TURN_OFF_RAD = 0.002, 0.003, 0.002, 0.005
NEAR_WALL_M = 0.01
"""A drive that ended farther from the wall was none at it."""
STILL_RAD_S = 0.01
RAMP_S = 0.12
"""How long after the last good intent an arm may go on as it went."""
MM = 1e3


class Marks(msgspec.Struct, frozen=True, kw_only=True):
    """When what happened in one probe, host's monotonic time, and what was told of it."""

    begun_ns: int
    last_asked_ns: int
    """The last intent that asked for motion was sent."""
    released_ns: int
    """It was over: from then on the driver asked to hold, or nobody asked for anything."""
    rested_ns: int
    """The way out was over, and rest waited for."""
    ended_ns: int
    start_m: Vec3
    """The tool when the list began, as the arm measured it."""
    limiters: tuple[str, ...] = ()
    """What changed a step on the way out."""
    refusal: str = ""
    """Why a step was refused, where one was; of silence the step that came after it."""
    is_latched: bool = False
    """The station latched by the end."""


class Carried(msgspec.Struct, frozen=True, kw_only=True):
    """One probe that was carried out."""

    probe: Probe
    marks: Marks
    sights: tuple[Sight, ...]
    """What was seen of the arm meanwhile, in order."""

    @property
    def is_done(self) -> bool:
        """Whether it came to its end: a silence ends with a refusal, nothing else does."""
        return bool(self.marks.refusal) is (self.probe.kind is Kind.SILENCE)


def judge_probe(carried: Carried, stopping: Stopping) -> tuple[BenchResult, ...]:
    """Return the figures of one probe, each with what it is asked to be.

    Args:
        carried: what came of it.
        stopping: of the limits that are held.
    """
    probe, marks, sights = carried.probe, carried.marks, carried.sights
    seen = [s for s in sights if marks.begun_ns <= s.seen_ns <= marks.ended_ns]
    if not seen:
        return (_row(probe, "looks", 0.0, "1", ">= 1", ok=False),)
    course = _Course(seen, marks, probe)
    rows = [*_OF_KIND[probe.kind](course, stopping)]
    speed = float(np.linalg.norm(course.tool_m_s, axis=1).max())
    rows.append(_at_most(probe, "speed_mm_s", MM * speed, "mm/s", MM * MOST_M_S))
    if probe.kind is not Kind.SILENCE:
        rows.append(_at_most(probe, "back_off_mm", MM * course.end_off_m, "mm", MM * BACK_OFF_M))
        refused = _row(probe, "refused", float(bool(marks.refusal)), "1", "0", ok=not marks.refusal)
        rows.append(_because(refused, "by", marks.refusal))
    return tuple(rows)


class _Course:
    """One probe's sights as arrays."""

    def __init__(self, seen: Sequence[Sight], marks: Marks, probe: Probe) -> None:
        self.probe, self.marks = probe, marks
        self._seen_ns = np.array([s.seen_ns for s in seen], dtype=np.int64)
        self.q_rad, self.qd_rad_s = (np.array([getattr(s, name) for s in seen]) for name in ("q_rad", "qd_rad_s"))
        self.off_m = np.array([s.tcp_m for s in seen]) - np.array(marks.start_m)  # (n, 3) from where the list began
        self.tool_m_s = np.array([s.tcp_speed_m_s for s in seen])
        self.along_m = self.off_m @ np.array(probe.along)
        self.end_off_m = float(np.linalg.norm(self.off_m[-1]))
        self.is_out = self._seen_ns <= marks.rested_ns

    def rest(self, since_ns: int) -> tuple[float, float]:
        """Return how long after an instant the joints rested for good, and how far the tool came until then.

        What comes after the way out counts no more. Infinite where they did not rest.
        """
        t_s = (self._seen_ns - since_ns) / 1e9
        chosen = (t_s >= 0.0) & self.is_out
        t_s, off_m = t_s[chosen], self.off_m[chosen]
        moving = np.flatnonzero(np.abs(self.qd_rad_s[chosen]).max(axis=1) >= STILL_RAD_S)
        k = int(moving[-1]) + 1 if len(moving) else 0
        if k >= len(t_s):
            return float("inf"), float("inf")
        return float(t_s[k]), float(np.linalg.norm(off_m[k] - off_m[0]))


def _turn(course: _Course, stopping: Stopping) -> Iterator[BenchResult]:
    del stopping
    probe, swept = course.probe, np.abs(course.q_rad - course.q_rad[0])
    turned = float(swept[:, WRIST].max())
    is_far = abs(turned - TURN_RAD) <= TURN_OFF_RAD
    yield _row(probe, "turn_rad", turned, "rad", f"{TURN_RAD:g} ± {TURN_OFF_RAD:g}", ok=is_far)
    others = float(np.delete(swept, WRIST, axis=1).max())
    yield _at_most(probe, "other_joints_rad", others, "rad", TURN_OFF_RAD)


def _line(course: _Course, stopping: Stopping) -> Iterator[BenchResult]:
    del stopping
    yield _way(course, WAY_M)
    yield _off_line(course)


def _release(course: _Course, stopping: Stopping) -> Iterator[BenchResult]:
    yield from _stop(course, course.marks.released_ns, stopping, late_s=0.0)
    yield _off_line(course)


def _wall(course: _Course, stopping: Stopping) -> Iterator[BenchResult]:
    del stopping
    probe, reached = course.probe, float(course.along_m.max())
    is_it = WALL_M - NEAR_WALL_M <= reached <= WALL_M
    goal = f"{MM * (WALL_M - NEAR_WALL_M):g} to {MM * WALL_M:g}"
    yield _row(probe, "reached_mm", MM * reached, "mm", goal, ok=is_it)
    yield _off_line(course)


def _silence(course: _Course, stopping: Stopping) -> Iterator[BenchResult]:
    yield from _stop(course, course.marks.last_asked_ns, stopping, late_s=RAMP_S)
    marks = course.marks
    latched = _row(course.probe, "latched", float(marks.is_latched), "1", "1", ok=marks.is_latched)
    yield _because(latched, "by", marks.refusal)


_OF_KIND: dict[Kind, Callable[[_Course, Stopping], Iterator[BenchResult]]] = {
    Kind.TURN: _turn, Kind.LINE: _line, Kind.RELEASE: _release, Kind.WALL: _wall, Kind.SILENCE: _silence,
}  # fmt: skip


def _stop(course: _Course, since_ns: int, stopping: Stopping, *, late_s: float) -> Iterator[BenchResult]:
    """Read a stop: within the limits file's time, and no farther than at the greatest speed for as long."""
    probe, (rest_s, way_m) = course.probe, course.rest(since_ns)
    came = float(course.along_m.max())
    yield _row(probe, "under_way_mm", MM * came, "mm", f">= {MM * UNDER_WAY_M / 2:g}", ok=came >= UNDER_WAY_M / 2)
    most_s = stopping.time_s + late_s
    yield _at_most(probe, "rest_ms", 1e3 * rest_s, "ms", 1e3 * most_s)
    yield _at_most(probe, "stop_mm", MM * way_m, "mm", MM * min(stopping.distance_m, MOST_M_S * most_s))


def _because(row: BenchResult, key: str, why: str) -> BenchResult:
    """Return a row with why it is so, where there is a reason."""
    return msgspec.structs.replace(row, details={key: why}) if why else row


def _way(course: _Course, asked_m: float) -> BenchResult:
    came = float(course.along_m.max())
    goal = f"{MM * asked_m:g} ± {MM * WAY_OFF_M:g}"
    row = _row(course.probe, "way_mm", MM * came, "mm", goal, ok=abs(came - asked_m) <= WAY_OFF_M)
    return row if row.ok else _because(row, "limited by", ", ".join(course.marks.limiters))


def _off_line(course: _Course) -> BenchResult:
    """Read how far the tool left its line, from where the probe began."""
    along = np.array(course.probe.along)
    off = course.off_m - course.off_m[0]
    away = float(np.linalg.norm(off - np.outer(off @ along, along), axis=1).max())
    return _at_most(course.probe, "off_line_mm", MM * away, "mm", MM * LINE_OFF_M)


def _at_most(probe: Probe, name: str, value: float, unit: str, most: float) -> BenchResult:
    return _row(probe, name, value, unit, f"<= {most:g}", ok=value <= most)


def _row(probe: Probe, name: str, value: float, unit: str, goal: str, *, ok: bool) -> BenchResult:
    return BenchResult(name=f"{probe.name}_{name}", value=value, unit=unit, goal=goal, ok=ok)
