"""Streams that no person would send on purpose. Pure: chance is a generator, the arm's state comes by `look`."""

import math
from collections.abc import Iterator

import numpy as np

from robot.messages import Grip, Heading, Hold, Intent, JointTarget, Twist, Vec3, Vec6
from robot.teleop.asks import Arena, Ask, Look, Send, Silence, Write

__all__ = [
    "backwards",
    "bursts",
    "chirps",
    "gate_jumps",
    "malformed",
    "mixed",
    "not_finite",
    "random_headings",
    "random_joints",
    "random_walk",
    "silences",
    "steps",
]

Rng = np.random.Generator
_BAD = (math.nan, math.inf, -math.inf)
_NOT_INTENTS: tuple[object, ...] = (None, 0, "twist", b"", [], {}, (0.0,) * 6, Twist, math.nan, True)


def steps(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Full speed one way, then at once another."""
    del look
    while True:
        velocity = _scaled(rng.normal(size=3), arena.speed_m_s * rng.uniform(0.5, 8.0))
        turn = (0.0, 0.0, float(rng.choice([-3.0, 0.0, 3.0])))
        for _ in range(int(rng.integers(3, 60))):
            yield Send(Twist(linear_m_s=velocity, angular_rad_s=turn))


def chirps(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """A to and fro along one line that gets faster and faster."""
    del look
    while True:
        along, amplitude = _scaled(rng.normal(size=3), 1.0), arena.speed_m_s * rng.uniform(0.5, 2.0)
        rate, growth, phase = rng.uniform(0.3, 2.0), rng.uniform(0.3, 2.0), 0.0
        for _ in range(200):
            phase += 2.0 * math.pi * rate * arena.tick_s
            rate *= math.exp(growth * arena.tick_s)
            yield Send(Twist(linear_m_s=_times(along, amplitude * math.cos(phase))))


def not_finite(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Good intents, and in between one with a number in it that is none."""
    while True:
        yield from _some(random_walk(look, arena, rng), int(rng.integers(1, 50)))
        yield Send(_spoilt(rng, look().q_rad))


def _spoilt(rng: Rng, q_rad: Vec6) -> Intent:
    bad, at = float(rng.choice(_BAD)), int(rng.integers(6))
    kind = int(rng.integers(3))
    if kind == 0:
        values = [0.0] * 6
        values[at] = bad
        return Twist(linear_m_s=_vec3(values[:3]), angular_rad_s=_vec3(values[3:]))
    if kind == 1:
        values = [0.0, 0.01, 0.2]
        values[at % 3] = bad
        return Heading(heading_rad=values[0], distance_m=values[1], height_m=values[2])
    values = list(q_rad)
    values[at] = bad
    return JointTarget(q_rad=_vec6(values))


def malformed(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Good intents, and in between one of the wrong length, the wrong type or out of all reason."""
    while True:
        yield from _some(random_headings(look, arena, rng), int(rng.integers(1, 50)))
        kind = int(rng.integers(5))
        if kind == 0:
            yield Send(_NOT_INTENTS[int(rng.integers(len(_NOT_INTENTS)))])
        elif kind == 1:
            yield Send(JointTarget(q_rad=look().q_rad[: int(rng.integers(6))]))  # pyright: ignore[reportArgumentType]
        elif kind == 2:
            yield Send(Twist(linear_m_s=(1e9, 0.0, -1e9)))
        elif kind == 3:
            yield Send(JointTarget(q_rad=("a",) * 6))  # pyright: ignore[reportArgumentType]
        else:
            yield Send(Hold(grip="crush"))  # pyright: ignore[reportArgumentType]


def backwards(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Commands to the gate whose numbers and stamps run backwards, repeat or skip."""
    while True:
        q = list(look().q_rad)
        for _ in range(int(rng.integers(1, 40))):
            q[int(rng.integers(6))] += rng.normal() * 0.2 * arena.tick_s
            yield Write(q_rad=_vec6(q))
        yield Write(
            q_rad=_vec6(q),
            sequence_off=int(rng.choice([0, -1, -7, 1, 1000])),
            stamp_off_ns=int(rng.choice([0, -1, 1]) * 10 ** rng.integers(6, 10)),
        )


def bursts(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Many contradicting intents at once, then a pause, then many again."""
    while True:
        for _ in range(int(rng.integers(5, 40))):
            yield Send(_any_intent(look, arena, rng))
        yield Silence(int(rng.integers(1, 30)))


def silences(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Full speed, then nothing at all for long."""
    del look
    while True:
        towards = _scaled(rng.normal(size=3), arena.speed_m_s * 2.0)
        for _ in range(int(rng.integers(10, 60))):
            yield Send(Twist(linear_m_s=towards))
        yield Silence(int(rng.integers(15, 80)))


def random_walk(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """A velocity that wanders, fast or slow."""
    del look
    velocity, keep = np.zeros(6), float(rng.uniform(0.8, 0.99))
    most = np.array([*(arena.speed_m_s * rng.uniform(0.3, 3.0),) * 3, 0.0, 0.0, 2.0])
    while True:
        velocity = keep * velocity + math.sqrt(1.0 - keep * keep) * most * rng.normal(size=6)
        yield Send(Twist(linear_m_s=_vec3(velocity[:3]), angular_rad_s=_vec3(velocity[3:])))


def random_headings(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """The paper's moves at random: a direction and a height for a while, the hand open or shut."""
    del look
    height = arena.box_m[1][2]
    while True:
        heading, up = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(-0.1, height))
        grip = [None, None, Grip.OPEN, Grip.CLOSE][int(rng.integers(4))]
        n_ticks = int(rng.choice([1, 1, 2, 5]))
        for _ in range(int(rng.integers(5, 40))):
            distance = float(rng.choice([0.0, 0.01, 0.022, 0.5]))
            yield Send(Heading(heading_rad=heading, distance_m=distance, height_m=up, grip=grip), n_ticks)


def random_joints(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Joint targets anywhere, near and far, some beyond the range."""
    while True:
        if rng.random() < 0.5:
            q = rng.uniform(arena.q_min_rad, arena.q_max_rad) * 1.2
        else:
            q = np.array(look().q_rad) + rng.normal(size=6) * rng.uniform(0.05, 1.0)
        for _ in range(int(rng.integers(2, 80))):
            yield Send(JointTarget(q_rad=_vec6(q)))


def gate_jumps(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """Joints to the gate: as fast as a joint may be, at once the other way, now and then a jump."""
    while True:
        q = np.array(look().q_rad)
        rate = np.array(arena.qd_max_rad_s) * rng.choice([-1.0, 0.0, 0.0, 1.0], size=6) * rng.uniform(0.1, 1.0)
        for _ in range(int(rng.integers(2, 40))):
            q = q + rate * arena.tick_s
            yield Write(q_rad=_vec6(q))
        if rng.random() < 0.2:
            yield Write(q_rad=_vec6(q + rng.normal(size=6) * 0.3))


def mixed(look: Look, arena: Arena, rng: Rng) -> Iterator[Ask]:
    """A different kind of intent at every tick."""
    while True:
        yield Send(_any_intent(look, arena, rng), int(rng.choice([1, 1, 1, 3])))


def _any_intent(look: Look, arena: Arena, rng: Rng) -> Intent:
    grip = [None, None, None, Grip.OPEN, Grip.CLOSE][int(rng.integers(5))]
    kind = int(rng.integers(4))
    if kind == 0:
        return Twist(linear_m_s=_scaled(rng.normal(size=3), arena.speed_m_s * 3.0), grip=grip)
    if kind == 1:
        heading, height = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(-0.1, 0.4))
        return Heading(heading_rad=heading, distance_m=0.022, height_m=height, grip=grip)
    if kind == 2:
        return JointTarget(q_rad=_vec6(np.array(look().q_rad) + rng.normal(size=6) * 0.3), grip=grip)
    return Hold(grip=grip)


def _some(asks: Iterator[Ask], n: int) -> Iterator[Ask]:
    for _ in range(n):
        yield next(asks)


def _scaled(direction: np.ndarray, length: float) -> Vec3:
    return _vec3(direction * (length / max(float(np.linalg.norm(direction)), 1e-9)))


def _times(direction: Vec3, by: float) -> Vec3:
    return direction[0] * by, direction[1] * by, direction[2] * by


def _vec3(x: np.ndarray | list[float]) -> Vec3:
    return float(x[0]), float(x[1]), float(x[2])


def _vec6(x: np.ndarray | list[float]) -> Vec6:
    return float(x[0]), float(x[1]), float(x[2]), float(x[3]), float(x[4]), float(x[5])
