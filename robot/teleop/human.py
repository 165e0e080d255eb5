"""Streams like a person's: smooth reaches with tremor, pauses, overshoot and corrections. Pure but for `look`."""

import math
from collections.abc import Iterator

import numpy as np

from robot.messages import Grip, Hold, Twist, Vec3
from robot.teleop.asks import Arena, Ask, Look, Send

__all__ = ["hesitations", "minimum_jerk", "presses", "reaches"]

Rng = np.random.Generator
TREMOR_HZ = (8.0, 12.0)
TREMOR_M = 0.0005
SLOW = 0.8
"""Share of the allowed speed at which a person is at most."""


def minimum_jerk(share: float) -> float:
    """Return the speed, in path lengths over the duration, at a share of a minimum-jerk reach: 30 s² (1 - s)²."""
    s = min(max(share, 0.0), 1.0)
    return 30.0 * s * s * (1.0 - s) * (1.0 - s)


def reaches(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Reach after reach to places of the workspace, past them by a little and back, with a tremor."""
    low, high = np.array(arena.box_m[0]), np.array(arena.box_m[1])
    while True:
        goal = rng.uniform(low, high)
        start = np.array(look().tcp_m)
        beyond = goal + (goal - start) * rng.uniform(0.0, 0.15)
        yield from _reach(look, beyond, arena, rng)
        yield from _reach(look, goal, arena, rng)
        for _ in range(int(rng.integers(5, 40))):
            yield Send(Hold())


def presses(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Over a thing, down on it, a moment there, and up again."""
    while True:
        x, y, z = arena.things_m[int(rng.integers(len(arena.things_m)))]
        over = np.array([x, y, z + 0.08])
        yield from _reach(look, over, arena, rng)
        yield from _reach(look, np.array([x, y, z - 0.02]), arena, rng)
        for _ in range(int(rng.integers(3, 20))):
            yield Send(Hold(grip=Grip.OPEN if rng.random() < 0.1 else None))
        yield from _reach(look, over, arena, rng)


def hesitations(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Reaches broken off half-way and taken up somewhere else."""
    low, high = np.array(arena.box_m[0]), np.array(arena.box_m[1])
    while True:
        reach = _reach(look, rng.uniform(low, high), arena, rng)
        for _ in range(int(rng.integers(5, 80))):
            ask = next(reach, None)
            if ask is None:
                break
            yield ask
        if rng.random() < 0.5:
            yield Send(Hold(), int(rng.integers(1, 6)))


def _reach(look: Look, goal: np.ndarray, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """One minimum-jerk reach, its duration such that its greatest speed is a person's."""
    path = goal - np.array(look().tcp_m)
    length = float(np.linalg.norm(path))
    if length < 1e-4:
        return
    duration = 1.875 * length / (SLOW * arena.speed_m_s * float(rng.uniform(0.5, 1.0))) + 0.1
    rate, phase = float(rng.uniform(*TREMOR_HZ)), float(rng.uniform(0.0, 2.0 * math.pi))
    across = rng.normal(size=3)
    across *= TREMOR_M * 2.0 * math.pi * rate / float(np.linalg.norm(across))
    n = math.ceil(duration / arena.tick_s)
    for k in range(n):
        speed = minimum_jerk((k + 0.5) / n) / duration
        yield Send(
            Twist(linear_m_s=_vec3(path * speed + across * math.cos(phase + 2.0 * math.pi * rate * k * arena.tick_s)))
        )


def _vec3(x: np.ndarray) -> Vec3:
    return float(x[0]), float(x[1]), float(x[2])
