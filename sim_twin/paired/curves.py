"""How far two paths of a point are apart: as curves, whatever the time, and in time."""

import msgspec
import numpy as np
from numpy.typing import NDArray

__all__ = ["Distance", "Track", "compare", "discrete_frechet_m", "even_points"]

Array = NDArray[np.float64]
SPACING_M = 5e-4
"""Points on the curves: a discrete distance is above the continuous one by no more than this."""
LAG_STEP_S = 0.001
LAG_LIMIT_S = 0.3


class Track(msgspec.Struct, frozen=True, kw_only=True):
    """Where a point was, and when."""

    t_s: Array  # (n,)
    p_m: Array  # (n, 3)


class Distance(msgspec.Struct, frozen=True, kw_only=True):
    """Two tracks compared."""

    frechet_m: float
    offset_s: float
    """How much later the second is; the shift in time at which the mean distance is least."""
    mean_m: float
    """Mean distance at the same time, when the second is shifted by that."""
    stretch_s: float
    """How much longer the second lasts."""
    length_m: float
    """Of the first."""


def compare(first: Track, second: Track) -> Distance:
    """Return how far two tracks are apart."""
    offset_s, mean_m = _offset(first, second)
    return Distance(
        frechet_m=discrete_frechet_m(even_points(first.p_m), even_points(second.p_m)),
        offset_s=offset_s,
        mean_m=mean_m,
        stretch_s=float(np.ptp(second.t_s) - np.ptp(first.t_s)),
        length_m=float(_lengths(first.p_m)[-1]),
    )


def discrete_frechet_m(first: Array, second: Array) -> float:
    """Return the discrete Fréchet distance of two rows of points.  (n, d), (m, d) -> ()

    Eiter and Mannila, Computing discrete Fréchet distance, TU Wien CD-TR 94/64 (1994): with ``c[i, j]`` the least
    longest leash of couplings that end at i and j, ``c[i, j] = max(d[i, j], min(c[i-1, j], c[i, j-1], c[i-1, j-1]))``.
    Cells of one anti-diagonal need only the two before it, so that each is one operation on arrays.
    """
    n, m = len(first), len(second)
    # Entry i of a diagonal k is the cell (i, k - i), shifted by one so that entry 0 lies outside.
    before, last = np.full(n + 1, np.inf), np.full(n + 1, np.inf)
    before[0] = -np.inf  # nothing comes before the first cell
    for k in range(n + m - 1):
        low, high = max(0, k - m + 1), min(k, n - 1) + 1
        here = np.full(n + 1, np.inf)
        distance = np.linalg.norm(first[low:high] - second[k - high + 1 : k - low + 1][::-1], axis=1)
        least = np.minimum(np.minimum(last[low:high], last[low + 1 : high + 1]), before[low:high])
        here[low + 1 : high + 1] = np.maximum(distance, least)
        before, last = last, here
    return float(last[n])


def even_points(p_m: Array, spacing_m: float = SPACING_M) -> Array:
    """Return points along the polygon at even distances, both ends included.  (n, 3) -> (k, 3)"""
    s = _lengths(p_m)
    at = np.linspace(0.0, s[-1], max(2, int(np.ceil(s[-1] / spacing_m)) + 1))
    return np.stack([np.interp(at, s, p_m[:, i]) for i in range(p_m.shape[1])], axis=1)


def _lengths(p_m: Array) -> Array:
    """Return the way to each point.  (n, 3) -> (n,)"""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p_m, axis=0), axis=1))])


def _offset(first: Track, second: Track) -> tuple[float, float]:
    """Return the lag of the second at which the two are nearest at the same time, and how near."""
    best = (0.0, np.inf)
    for lag_s in np.arange(-LAG_LIMIT_S, LAG_LIMIT_S + LAG_STEP_S / 2, LAG_STEP_S):
        shifted_s = second.t_s - lag_s
        is_shared = (first.t_s >= shifted_s[0]) & (first.t_s <= shifted_s[-1])
        if not is_shared.any():
            continue
        there = np.stack([np.interp(first.t_s[is_shared], shifted_s, second.p_m[:, i]) for i in range(3)], axis=1)
        mean_m = float(np.linalg.norm(first.p_m[is_shared] - there, axis=1).mean())
        if mean_m < best[1]:
            best = (float(lag_s), mean_m)
    return best
