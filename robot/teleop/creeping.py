"""Streams that are led to a limit by motion and then go on past it at the gate, slowly. Pure but for `look`.

Who is fast is refused a braking distance before a limit. Who creeps is refused at the limit itself: so these say where
the gate puts it.
"""

import math
from collections.abc import Iterator

import numpy as np

from robot.messages import Grip, GripCommand, Hold, JointTarget, Twist, Vec6
from robot.teleop.aimed import TOUCH_N, towards
from robot.teleop.asks import Arena, Ask, Look, Send, Write

__all__ = ["gate_creeps", "gate_hands", "gate_leans"]

Rng = np.random.Generator
RISE_RAD = 2e-4
"""Creeping begins by as much more in each tick."""
SINKING_RAD = 6e-4
"""A button's travel is gone through at so much a tick."""
BORNE_N = 12.0
"""A button's spring bears less, what does not give way bears more."""
SETTLING = 12
"""Ticks in which an arm that is told to hold comes to rest."""


def gate_creeps(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Joints one way, or the wrist's alone, as far as motion lets them, then on at the gate."""
    while True:
        first = 3 * int(rng.integers(2))
        way = rng.normal(size=6) * np.where(rng.random(6) < 0.5, 1.0, 0.0) * (np.arange(6) >= first)
        way[int(rng.integers(first, 6))] += rng.choice([-1.0, 1.0])
        way /= np.abs(way).max()
        start, far_rad = np.array(look().q_rad), float(rng.uniform(0.3, 2.0))
        for _ in range(int(rng.integers(60, 160))):
            yield Send(JointTarget(q_rad=_vec6(start + far_rad * way)))
        most_rad = arena.tick_s * float(10.0 ** rng.uniform(-1.3, -0.5))
        yield from _creep(look, way, most_rad, n=200)


def gate_leans(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Down on a thing until it is felt, then more and more weight on it at the gate."""
    while True:
        x, y, z = arena.things_m[int(rng.integers(len(arena.things_m)))]
        over = np.array([x, y, z + 0.05]) + rng.normal(size=3) * [0.01, 0.01, 0.0]
        yield from towards(look, over, arena, rng, n=100, grip=Grip.CLOSE)
        for _ in range(80):
            if math.hypot(*look().force_n) > TOUCH_N:
                break
            yield Send(Twist(linear_m_s=(0.0, 0.0, -0.5 * arena.speed_m_s), grip=Grip.CLOSE))
        way = np.array([0.0, 1.0, rng.uniform(-0.2, 0.2), -1.0, 0.0, 0.0])
        yield from _creep(look, way, SINKING_RAD, n=200, slow_rad=float(10.0 ** rng.uniform(-4.5, -3.5)))


def gate_hands(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """The hand told at the gate to do a little more or less than it may, where the arm is."""
    least, (opened, shut) = arena.grip_least, arena.grip
    while True:
        q = look().q_rad
        more, n = float(rng.choice([1.0, 1.01, 1.03, 1.045, 1.2])), int(rng.integers(10, 60))
        hand, by, at = (least, 1.0 / more, rng.integers(2)) if rng.random() < 0.5 else (opened, more, rng.integers(3))
        excess = np.ones(3)
        excess[2 - int(at)] = by  # an opening of nought has no less
        for k in range(n):
            opening_m = (opened if k // 20 % 2 else shut).opening_m
            yield Write(
                q_rad=q,
                grip=GripCommand(
                    opening_m=opening_m * excess[0],
                    force_n=hand.force_n * excess[1],
                    speed_m_s=hand.speed_m_s * excess[2],
                ),
            )


def _creep(look: Look, way: np.ndarray, most_rad: float, *, n: int, slow_rad: float | None = None) -> Iterator[Ask]:
    """Come to rest and go on from where the arm is, by at most so much a tick along some joints, until a latch.

    Args:
        look: what is felt.
        way: of the joints.
        most_rad: of a tick.
        n: ticks at the most.
        slow_rad: of a tick once something bears the tool; None for no slower.
    """
    for _ in range(SETTLING):
        yield Send(Hold())
    q, step_rad = np.array(look().q_rad), 0.0
    for _ in range(n):
        seen = look()
        if seen.is_latched:
            return
        is_borne = slow_rad is not None and math.hypot(*seen.force_n) > BORNE_N
        step_rad = slow_rad if is_borne and slow_rad is not None else min(most_rad, step_rad + RISE_RAD)
        q = q + way * step_rad
        yield Write(q_rad=_vec6(q))


def _vec6(x: np.ndarray) -> Vec6:
    return float(x[0]), float(x[1]), float(x[2]), float(x[3]), float(x[4]), float(x[5])
