"""Streams that go for a limit: straight at it, along it, round it, and back at the touch. Pure but for `look`."""

import math
from collections.abc import Iterator

import numpy as np

from robot.messages import Grip, GripCommand, JointTarget, Twist, Vec3, Vec6
from robot.teleop.asks import Arena, Ask, Look, Send, Write

__all__ = [
    "at_the_box",
    "at_the_fences",
    "at_the_joints",
    "at_the_singular",
    "at_the_things",
    "circles",
    "fast_joints",
    "full_speed",
    "gate_at_places",
    "gate_grips",
    "gate_presses",
    "grasps",
    "reversals",
    "tilts",
    "towards",
]

Rng = np.random.Generator
NEAR_M = 0.01
TOUCH_N = 2.0


def at_the_box(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Straight at a face, an edge or a corner of the workspace, and on."""
    low, high = np.array(arena.box_m[0]), np.array(arena.box_m[1])
    while True:
        at = np.array(look().tcp_m)
        side = rng.choice([-1.0, 0.0, 1.0], size=3)
        goal = np.where(side > 0, high + 0.2, np.where(side < 0, low - 0.2, at))
        yield from towards(look, goal, arena, rng, n=int(rng.integers(60, 250)))


def at_the_fences(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Straight at what lies beyond a plane or inside a keep-out."""
    while True:
        goals = arena.fences_m or arena.things_m
        goal = np.array(goals[int(rng.integers(len(goals)))]) + rng.normal(size=3) * 0.05
        yield from towards(look, goal, arena, rng, n=int(rng.integers(60, 250)))


def at_the_things(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Over a thing or beside it, and then at it with all speed, the hand open or shut."""
    while True:
        x, y, z = arena.things_m[int(rng.integers(len(arena.things_m)))]
        beside = rng.normal(size=3) * [0.06, 0.06, 0.0] if rng.random() < 0.5 else np.zeros(3)
        over = np.array([x, y, rng.uniform(z, 0.3)]) + beside
        grip = [None, Grip.OPEN, Grip.CLOSE][int(rng.integers(3))]
        yield from towards(look, over, arena, rng, n=120, grip=grip)
        yield from towards(look, np.array([x, y, z - 0.1]), arena, rng, n=int(rng.integers(40, 120)), grip=grip)
        yield from towards(look, over + np.array([0.0, 0.0, 0.1]), arena, rng, n=25, grip=grip)


def at_the_joints(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """One joint as far as it goes and beyond, the others kept: first the last one, which the workspace leaves free."""
    while True:
        joint = int(rng.choice([5, 5, 5, 4, 3, 2, 1, 0]))
        end = (arena.q_max_rad if rng.random() < 0.5 else arena.q_min_rad)[joint]
        for _ in range(int(rng.integers(150, 1200))):
            q = list(look().q_rad)
            q[joint] = end * 1.3
            yield Send(JointTarget(q_rad=_vec6(q)), 2)


def fast_joints(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """One joint or a few to and fro as fast as they are let."""
    del arena
    while True:
        start = np.array(look().q_rad)
        swing = np.where(rng.random(6) < 0.4, rng.choice([-1.0, 1.0], size=6), 0.0) * rng.uniform(0.1, 3.0)
        swing[5] += rng.choice([-2.0, 0.0, 2.0])
        for way in (1.0, -1.0) * int(rng.integers(1, 4)):
            for _ in range(int(rng.integers(20, 90))):
                yield Send(JointTarget(q_rad=_vec6(start + way * swing)))


def tilts(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Wrist joints that tilt the tool further and further."""
    while True:
        start = np.array(look().q_rad)
        by = np.array([0.0, 0.0, 0.0, rng.normal(), rng.normal(), rng.normal()]) * 1.5
        for _ in range(int(rng.integers(60, 250))):
            yield Send(JointTarget(q_rad=_vec6(start + by)))
        for _ in range(int(rng.integers(20, 100))):
            yield Send(Twist(linear_m_s=_vec3(rng.normal(size=3) * arena.speed_m_s)))


def at_the_singular(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Over the base, stretched right out, elbow straight, or wrist 2 at zero."""
    while True:
        kind = int(rng.integers(4))
        if kind == 0:
            yield from towards(look, np.array([0.0, 0.0, rng.uniform(0.1, 0.5)]), arena, rng, n=200)
        elif kind == 1:
            bearing = rng.uniform(-1.2, 1.2)
            goal = np.array([1.2 * math.cos(bearing), 1.2 * math.sin(bearing), rng.uniform(0.05, 0.3)])
            yield from towards(look, goal, arena, rng, n=200)
        else:
            joint = 2 if kind == 2 else 4
            for _ in range(200):
                q = list(look().q_rad)
                q[joint] = 0.0
                yield Send(JointTarget(q_rad=_vec6(q)))


def full_speed(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """From one end of the workspace to the other along its longest lines, faster than allowed."""
    low, high = np.array(arena.box_m[0]), np.array(arena.box_m[1])
    while True:
        corner = np.where(rng.random(3) < 0.5, low, high)
        corner[2] = rng.uniform(0.6 * high[2], high[2])
        yield from towards(look, corner, arena, rng, n=160, speed=5.0)


def circles(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Round a point of the workspace's edge, in it and out of it, smaller and larger."""
    low, high = np.array(arena.box_m[0]), np.array(arena.box_m[1])
    while True:
        centre = np.where(rng.random(3) < 0.5, low, high)
        centre = np.where(rng.random(3) < 0.6, centre, rng.uniform(low, high))
        yield from towards(look, centre, arena, rng, n=120)
        rate, u, v = rng.uniform(1.0, 12.0), rng.normal(size=3), rng.normal(size=3)
        u /= np.linalg.norm(u)
        v -= u * (u @ v)
        v /= np.linalg.norm(v)
        for k in range(int(rng.integers(50, 200))):
            phase = rate * k * arena.tick_s
            velocity = arena.speed_m_s * rng.uniform(0.8, 1.5) * (math.cos(phase) * u + math.sin(phase) * v)
            yield Send(Twist(linear_m_s=_vec3(velocity)))


def reversals(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Down until something is felt, away at once, and down again."""
    while True:
        x, y, z = arena.things_m[int(rng.integers(len(arena.things_m)))]
        yield from towards(look, np.array([x, y, z + 0.1]), arena, rng, n=120)
        for _ in range(int(rng.integers(2, 8))):
            for _ in range(80):
                yield Send(Twist(linear_m_s=(0.0, 0.0, -2.0 * arena.speed_m_s)))
                if math.hypot(*look().force_n) > TOUCH_N:
                    break
            away = (*(rng.normal(size=2) * arena.speed_m_s).tolist(), 2.0 * arena.speed_m_s)
            for _ in range(int(rng.integers(1, 12))):
                yield Send(Twist(linear_m_s=_vec3(list(away))))


def grasps(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Over something loose, down, shut, up and off with it, opened in mid-air or not."""
    while True:
        x, y, z = arena.loose_m[int(rng.integers(len(arena.loose_m)))] if arena.loose_m else arena.things_m[0]
        yield from towards(look, np.array([x, y, 0.25]), arena, rng, n=150, grip=Grip.OPEN)
        yield from towards(look, np.array([x, y, z]), arena, rng, n=100, grip=Grip.OPEN)
        yield from towards(look, np.array([x, y, z]), arena, rng, n=50, grip=Grip.CLOSE, stay=True)
        yield from towards(look, np.array([x, y, 0.35]), arena, rng, n=40, grip=Grip.CLOSE)
        shaken = rng.normal(size=3) * 3.0 * arena.speed_m_s
        for k in range(60):
            sign = 1.0 if k // 8 % 2 else -1.0
            yield Send(Twist(linear_m_s=_vec3(sign * shaken), grip=Grip.CLOSE if rng.random() < 0.99 else Grip.OPEN))


def gate_at_places(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Joints to the gate, ever faster and as fast as allowed, towards another pose, past all that motion knows of."""
    while True:
        q = np.array(look().q_rad)
        way = rng.normal(size=6) * np.where(rng.random(6) < 0.5, 1.0, 0.0)
        way /= max(1e-9, float(np.abs(way / np.array(arena.qd_max_rad_s)).max()))
        speed, rise, most = 0.0, float(rng.uniform(0.01, 0.08)), float(rng.choice([0.3, 0.7, 0.999, 1.045]))
        for _ in range(int(rng.integers(20, 200))):
            speed = min(most, speed + rise)
            q = q + way * speed * arena.tick_s
            yield Write(q_rad=_vec6(q))


def gate_presses(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Joints to the gate that go on pressing on what the tool stands on."""
    while True:
        x, y, z = arena.things_m[int(rng.integers(len(arena.things_m)))]
        yield from towards(look, np.array([x, y, z - 0.05]), arena, rng, n=150)
        q, push = np.array(look().q_rad), rng.uniform(0.0005, 0.01)
        for _ in range(80):
            q = q + push * np.array([0.0, 1.0, rng.uniform(-0.2, 0.2), -1.0, 0.0, 0.0])
            yield Write(q_rad=_vec6(q))


def gate_grips(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """The hand told straight at the gate to press harder, go faster or open wider than it may, around something."""
    most = arena.grip
    loose = arena.loose_m or arena.things_m
    while True:
        x, y, z = loose[int(rng.integers(len(loose)))]
        if rng.random() < 0.7:
            yield from towards(look, np.array([x, y, z]), arena, rng, n=180, grip=Grip.OPEN)
        q = look().q_rad
        excess = np.full(3, 1.0)
        excess[int(rng.integers(3))] = rng.choice([1.0, 1.03, 1.045, 1.3])
        for k in range(60):
            hand = most[k // 30 % 2]
            yield Write(
                q_rad=q,
                grip=GripCommand(
                    opening_m=hand.opening_m * excess[0],
                    force_n=hand.force_n * excess[1],
                    speed_m_s=hand.speed_m_s * excess[2],
                ),
            )


def towards(
    look: Look,
    goal: np.ndarray,
    arena: Arena,
    rng: Rng,
    *,
    n: int,
    speed: float | None = None,
    grip: Grip | None = None,
    stay: bool = False,
) -> Iterator[Ask]:
    """Drive at a point for n asks or until it is reached; the speed asked for is drawn anew each time."""
    fast = arena.speed_m_s * (float(rng.uniform(0.5, 4.0)) if speed is None else speed)
    n_ticks = int(rng.choice([1, 1, 2]))
    for _ in range(n):
        apart = goal - np.array(look().tcp_m)
        away = float(np.linalg.norm(apart))
        if away < NEAR_M and not stay:
            return
        pace = min(fast, 5.0 * away)
        yield Send(Twist(linear_m_s=_vec3(apart * (pace / max(away, 1e-9))), grip=grip), n_ticks)


def _vec3(x: np.ndarray | list[float]) -> Vec3:
    return float(x[0]), float(x[1]), float(x[2])


def _vec6(x: np.ndarray | list[float]) -> Vec6:
    return float(x[0]), float(x[1]), float(x[2]), float(x[3]), float(x[4]), float(x[5])
