"""Weight put on a thing upright, past motion at the gate, a little more in each tick. Pure but for `look`.

Joints that press a tool down lead it aside as well, and what it stands on rubs: the gate counts that beside the weight
and stops them early. Here what pushes aside is given way to, so that the weight alone says where the gate puts it.
"""

import math
from collections.abc import Generator, Iterator

import numpy as np
from numpy.typing import NDArray

from robot.messages import Grip, Hold, Twist, Vec6
from robot.teleop.aimed import NEAR_M, TOUCH_N
from robot.teleop.asks import Arena, Ask, Look, Send, Write

__all__ = ["gate_weighs"]

Array = NDArray[np.float64]
ALOFT_M, OVER_M = 0.2, 0.04
"""How high the tool travels, and how far over a thing it is brought before it goes slowly."""
TRAVEL_M_S, SLOWLY_M_S, TRAVEL, TICKS = 0.5, 0.1, 80, 2
FEELING, FEELING_TICKS = 5, 3
"""So many asks one way, of so many ticks, to see how the joints lead the tool."""
DESCENT, SETTLING, SETTLING_TICKS, WEIGHING = 25, 3, 4, 300
BORNE_N = 12.0
"""A button's spring bears less, what does not give way bears more."""
SINKING_M, ONSET_M = 6e-4, 1e-4
"""A button's travel is gone through at so much a tick, begun by as much more in each."""
ASIDE_M_N, ASIDE_M = 1e-5, 1e-4
"""How far what pushes aside is given way to in a tick, for each newton and at the most."""


def gate_weighs(look: Look, arena: Arena, rng: np.random.Generator) -> Iterator[Ask]:
    """Down on a thing until it is felt, then at the gate more and more weight on it, straight down."""
    while True:
        x, y, z = np.array(arena.things_m[int(rng.integers(len(arena.things_m)))]) + rng.normal(size=3) * [
            0.01,
            0.01,
            0,
        ]
        yield from _led_to(look, np.array([x, y, max(z + OVER_M, ALOFT_M)]))
        yield from _led_to(look, np.array([x, y, z + OVER_M]))
        ways = yield from _felt_ways(look)
        for _ in range(DESCENT):
            if math.hypot(*look().force_n) > TOUCH_N:
                break
            yield _led(np.array([0.0, 0.0, -SLOWLY_M_S]), TICKS)
        else:
            continue  # nothing is there
        for _ in range(SETTLING):
            yield Send(Hold(grip=Grip.CLOSE), SETTLING_TICKS)
        yield from _weighed_down(look, ways, more_m_n=float(10.0 ** rng.uniform(-6.2, -5.9)))


def _led(velocity_m_s: Array, n_ticks: int) -> Send:
    x, y, z = velocity_m_s.tolist()
    return Send(Twist(linear_m_s=(x, y, z), grip=Grip.CLOSE), n_ticks)


def _led_to(look: Look, goal_m: Array) -> Iterator[Ask]:
    for _ in range(TRAVEL):
        apart_m = goal_m - np.array(look().tcp_m)
        away_m = float(np.linalg.norm(apart_m))
        if away_m < NEAR_M:
            return
        yield _led(apart_m * min(TRAVEL_M_S / away_m, 5.0), TICKS)


def _felt_ways(look: Look) -> Generator[Ask, None, Array]:
    """Lead the tool a little way along x, y and down, and see by how much joints go for it.

    Returns:
        Joints' radians for each metre along x, y and z; nothing for a way that something bars.  (6, 3)
    """
    seen = [look()]
    for way in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)):
        for _ in range(FEELING):
            yield _led(SLOWLY_M_S * np.array(way), FEELING_TICKS)
        seen.append(look())
    by_rad = np.diff([s.q_rad for s in seen], axis=0).T
    by_m = np.diff([s.tcp_m for s in seen], axis=0).T
    return by_rad @ np.linalg.pinv(by_m, rcond=0.1)


def _weighed_down(look: Look, ways: Array, *, more_m_n: float) -> Iterator[Ask]:
    """Go down from where the arm is until a latch, by so much a tick for each newton once something bears the tool."""
    q, down_m = np.array(look().q_rad), 0.0
    for _ in range(WEIGHING):
        seen = look()
        if seen.is_latched:
            return
        fx, fy, fz = seen.force_n
        down_m = min(more_m_n * fz, SINKING_M) if fz > BORNE_N else min(SINKING_M, down_m + ONSET_M)
        aside = np.clip(ASIDE_M_N * np.array([fx, fy]), -ASIDE_M, ASIDE_M)
        q = q + ways @ np.array([*aside, -down_m])
        yield Write(q_rad=_vec6(q))


def _vec6(x: Array) -> Vec6:
    return float(x[0]), float(x[1]), float(x[2]), float(x[3]), float(x[4]), float(x[5])
