"""A search for the stream that comes nearest to a limit: the cross-entropy method over a few knots of intents.

R. Y. Rubinstein, "The cross-entropy method for combinatorial and continuous optimization" (1999): draw candidates from
a normal distribution, keep the best, fit the distribution to them, again.
"""

from collections.abc import Iterator

import numpy as np

from robot.messages import Grip, JointTarget, Twist
from robot.teleop.asks import Arena, Ask, Look, Send

__all__ = ["Candidates", "played"]

N_KNOTS, N_VALUES = 8, 14
"""A knot: whether joints or a velocity, six of either, the hand."""
N_GENERATIONS, N_DRAWN, N_BEST = 4, 8, 3
LEAST_SPREAD = 0.15
JOINT_SPAN_RAD = 2.0


class Candidates:
    """Proposes knots and learns from what came of them; the lower a score, the nearer to the limit."""

    BLOCK = N_GENERATIONS * N_DRAWN

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._mean, self._spread = np.zeros((N_KNOTS, N_VALUES)), np.ones((N_KNOTS, N_VALUES))
        self._came: list[tuple[float, np.ndarray]] = []

    def propose(self) -> np.ndarray:
        """Return a candidate.  () -> (knots, values)"""
        return self._mean + self._spread * self._rng.normal(size=self._mean.shape)

    def learn(self, knots: np.ndarray, score: float) -> None:
        """Take note of a score; after a whole generation the next is drawn nearer to the best."""
        self._came.append((score, knots))
        if len(self._came) == N_DRAWN:
            best = np.stack([k for _, k in sorted(self._came, key=lambda pair: pair[0])[:N_BEST]])
            self._mean, self._spread = best.mean(axis=0), np.maximum(best.std(axis=0), LEAST_SPREAD)
            self._came = []


def played(knots: np.ndarray, look: Look, arena: Arena) -> Iterator[Ask]:
    """Play the knots one after another, for ever."""
    n_ticks = round(0.4 / arena.tick_s)
    while True:
        for knot in knots:
            start = np.array(look().q_rad)
            grip = None if abs(knot[13]) < 1.0 else Grip.OPEN if knot[13] > 0.0 else Grip.CLOSE
            for _ in range(n_ticks):
                if knot[0] > 0.3:
                    q = (start + JOINT_SPAN_RAD * knot[7:13]).tolist()
                    yield Send(JointTarget(q_rad=(q[0], q[1], q[2], q[3], q[4], q[5]), grip=grip))
                else:
                    x, y, z, _, _, turn = (2.0 * arena.speed_m_s * knot[1:7]).tolist()
                    yield Send(Twist(linear_m_s=(x, y, z), angular_rad_s=(0.0, 0.0, turn), grip=grip))
