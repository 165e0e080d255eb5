"""A search for the stream that comes nearest to a limit: hill climbing from the best of a few random beginnings.

A block has room for a few dozen streams, too few to fit a distribution to a hundred numbers: what is nearest so far is
kept, and a few of its knots are drawn anew or nudged.
"""

from collections.abc import Iterator

import numpy as np

from robot.messages import Grip, JointTarget, Twist
from robot.teleop.asks import Arena, Ask, Look, Send

__all__ = ["Candidates", "played"]

N_KNOTS, N_VALUES = 8, 14
"""A knot: whether joints or a velocity, six of either, the hand."""
N_BLOCK, N_RANDOM = 32, 8
KNOTS_CHANGED = 0.3
NUDGE = 0.4
JOINT_SPAN_RAD = 2.0


class Candidates:
    """Proposes knots and learns from what came of them; the lower a score, the nearer to the limit."""

    BLOCK = N_BLOCK

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._n = 0
        self._best: tuple[float, np.ndarray] | None = None

    def propose(self) -> np.ndarray:
        """Return a candidate.  () -> (knots, values)"""
        rng, fresh = self._rng, self._rng.normal(size=(N_KNOTS, N_VALUES))
        self._n += 1
        if self._n <= N_RANDOM or self._best is None:
            return fresh
        best = self._best[1]
        changed = rng.random((N_KNOTS, 1)) < KNOTS_CHANGED
        return np.where(changed, np.where(rng.random() < 0.5, fresh, best + NUDGE * fresh), best)

    def learn(self, knots: np.ndarray, score: float) -> None:
        """Take note of a score."""
        if self._best is None or score < self._best[0]:
            self._best = (score, knots)


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
