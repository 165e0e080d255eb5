"""How far what was seen is from what was there, over labelled pictures. Pure maths."""

import math
from collections.abc import Iterable, Sequence

import msgspec
import numpy as np

from config.scenario import Scenario
from perception.detection.seen import Detections, LampState, LidState
from robot.messages import Vec3
from robot.photographs import Photograph

__all__ = ["FALSE_M", "Score", "f1_of", "percentile", "score", "total", "upper_bound"]

FALSE_M = 0.010
"""A place that is farther off than this is not a place with an error but a false one."""


class Score(msgspec.Struct, frozen=True, kw_only=True):
    """What came of some pictures."""

    errors_m: tuple[float, ...] = ()
    """Along the table, of every thing that was placed."""
    distance_errors_m: tuple[float, ...] = ()
    """Of its distance from the tool centre point."""
    n_seeable: int = 0
    """Things that were not in a shut box: what stands behind others or behind the arm is among them."""
    n_false: int = 0
    """Things that were placed, and farther off than FALSE_M."""
    n_things: int = 0
    lamps: tuple[int, int, int, int, int] = (0, 0, 0, 0, 0)
    """Lit and told so, lit and told dark, dark and told lit, dark and told so, not told."""
    lids: tuple[int, int, int] = (0, 0, 0)
    """Right, wrong, not told."""


def score(photograph: Photograph, seen: Detections, scenario: Scenario, tcp_m: Vec3 | None) -> Score:
    """Return what came of one picture.

    Raises:
        ValueError: labels and detections are not of the same things.
    """
    if [o.name for o in photograph.objects] != [t.name for t in seen.things]:
        raise ValueError("expected labels of the scenario's things in its order")
    errors, distances, n_false = [], [], 0
    for truth, found in zip(photograph.objects, seen.things, strict=True):
        if found.position_m is None:
            continue
        error = math.dist(truth.position_m[:2], found.position_m[:2])
        errors.append(error)
        n_false += error > FALSE_M
        if tcp_m is not None:
            distances.append(abs(math.dist(tcp_m, truth.position_m) - math.dist(tcp_m, found.position_m)))
    return Score(
        errors_m=tuple(errors), distance_errors_m=tuple(distances),
        n_seeable=len(seen.things) - _n_shut_in(photograph, scenario), n_false=n_false, n_things=len(seen.things),
        lamps=_lamps(photograph, seen), lids=_lids(photograph, seen),
    )  # fmt: skip


def total(scores: Iterable[Score]) -> Score:
    """Return the sum of several."""
    parts = list(scores)
    return Score(
        errors_m=tuple(e for s in parts for e in s.errors_m),
        distance_errors_m=tuple(e for s in parts for e in s.distance_errors_m),
        n_seeable=sum(s.n_seeable for s in parts),
        n_false=sum(s.n_false for s in parts),
        n_things=sum(s.n_things for s in parts),
        lamps=(_sum(parts, 0), _sum(parts, 1), _sum(parts, 2), _sum(parts, 3), _sum(parts, 4)),
        lids=(sum(s.lids[0] for s in parts), sum(s.lids[1] for s in parts), sum(s.lids[2] for s in parts)),
    )


def _sum(parts: Sequence[Score], kind: int) -> int:
    return sum(s.lamps[kind] for s in parts)


def f1_of(lamps: Sequence[int]) -> float:
    """Return F1 of "lit" over what was told; not a number where nothing was lit and nothing told so."""
    hit, missed, false = lamps[:3]
    return 2.0 * hit / (2.0 * hit + missed + false) if hit + missed + false else math.nan


def upper_bound(n_wrong: int, n: int) -> float:
    """Return the 95 % upper bound of a rate of which n_wrong of n were seen: exact where none was, else Wilson's."""
    if n == 0:
        return 1.0
    if n_wrong == 0:
        return 1.0 - 0.05 ** (1.0 / n)
    z, p = 1.645, n_wrong / n
    middle = p + z * z / (2.0 * n)
    half = z * math.sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n))
    return (middle + half) / (1.0 + z * z / n)


def percentile(values: Sequence[float], share: float) -> float:
    """Return a percentile, infinite where there is nothing."""
    return float(np.percentile(values, share)) if len(values) else math.inf


def _n_shut_in(photograph: Photograph, scenario: Scenario) -> int:
    """Return how many cylinders are in boxes whose lids are shut."""
    place = {o.name: o.position_m for o in photograph.objects}
    shut = [b for b in scenario.boxes if b.lid is not None and b.name not in photograph.lids_open]
    return sum(
        any(
            all(abs(place[c.name][i] - place[b.name][i]) < b.inner_m[i] / 2.0 for i in (0, 1)) for b in shut
        )
        for c in scenario.cylinders
    )  # fmt: skip


def _lamps(photograph: Photograph, seen: Detections) -> tuple[int, int, int, int, int]:
    counts = [0, 0, 0, 0, 0]
    for lamp in seen.lamps:
        if lamp.state is LampState.UNKNOWN:
            counts[4] += 1
        else:
            counts[2 * (lamp.name not in photograph.lamps_on) + (lamp.state is LampState.OFF)] += 1
    return counts[0], counts[1], counts[2], counts[3], counts[4]


def _lids(photograph: Photograph, seen: Detections) -> tuple[int, int, int]:
    told = [lid for lid in seen.lids if lid.state is not LidState.UNKNOWN]
    n_right = sum((lid.state is LidState.OPEN) == (lid.name in photograph.lids_open) for lid in told)
    return n_right, len(told) - n_right, len(seen.lids) - len(told)
