"""Joint motions that show much of an arm: pushes and pauses of every joint, at its own times. Maths."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["excite"]

Array = NDArray[np.float64]
PUSH_S, PAUSE_S = (0.08, 0.35), (0.0, 0.35)
SHARE_PAUSED = 0.35


def excite(
    rng: np.random.Generator, *, seconds: float, tick_s: float, reach_rad: float, acceleration_rad_s2: float
) -> Array:
    """Return offsets from a pose, beginning and ending there at rest.

    Each joint goes to and fro by itself: it speeds up evenly, slows down evenly, and sometimes waits.

    Args:
        rng: of this motion.
        seconds: how long.
        tick_s: of the rows.
        reach_rad: how far a joint goes from the pose.
        acceleration_rad_s2: at most.

    Returns:
        (n, 6)
    """
    n = round(seconds / tick_s)
    return np.stack([_joint(rng, n, tick_s, reach_rad, acceleration_rad_s2) for _ in range(6)], axis=1)


def _joint(rng: np.random.Generator, n: int, tick_s: float, reach: float, most: float) -> Array:
    at = np.zeros(n)
    k, here = round(0.2 / tick_s), 0.0
    while k < n:
        half = max(2, round(rng.uniform(*PUSH_S) / tick_s))
        farthest = most * (half * tick_s) ** 2
        goal = float(np.clip(rng.uniform(-reach, reach), here - farthest, here + farthest))
        if k + 2 * half > n - round(0.6 / tick_s):
            break
        share = np.arange(1, 2 * half + 1) / (2 * half)
        way = np.where(share < 0.5, 2.0 * share**2, 1.0 - 2.0 * (1.0 - share) ** 2)
        at[k : k + 2 * half] = here + (goal - here) * way
        k, here = k + 2 * half, goal
        pause = round(rng.uniform(*PAUSE_S) / tick_s) if rng.random() < SHARE_PAUSED else 0
        at[k : k + pause] = here
        k += pause
    left = n - k
    if left > 0:
        share = np.minimum(1.0, np.arange(1, left + 1) / max(1, round(0.5 / tick_s)))
        at[k:] = here * (1.0 - (3.0 * share**2 - 2.0 * share**3))
    return at
