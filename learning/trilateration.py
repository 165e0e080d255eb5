"""Where the tool was, from distances to things whose places are known. Pure."""

import numpy as np

__all__ = ["relocate"]

Array = np.ndarray

N_ITERATIONS = 5
RIDGE, STAYS = 1e-3, 1e9
TINY = 1e-9


def relocate(places: Array, distances_m: Array, things: Array, weights: Array, *, keeps_height: bool) -> Array:
    """Return the places from which the distances to things are as they were seen.

    Gauss-Newton on the weighted squares of what distances lack, with a ridge that keeps steps small where no distance
    tells.

    Args:
        places: Where the tool was thought to have been, metres, (k, 3).
        distances_m: Distances seen from there, (k, n).
        things: Where things are, metres, (n, 3).
        weights: How much each thing's distance counts, (n,).
        keeps_height: Heights are known and stay.

    Returns:
        Metres, (k, 3).
    """
    ridge = np.diag([RIDGE, RIDGE, STAYS if keeps_height else RIDGE])
    for _ in range(N_ITERATIONS):
        o = places[:, None] - things
        d = np.sqrt(np.einsum("kij,kij->ki", o, o) + TINY)
        ray = o / d[..., None]
        normal = np.einsum("kia,kib,i->kab", ray, ray, weights) + ridge
        lack = np.einsum("kia,ki,i->ka", ray, distances_m - d, weights)
        places = places + np.linalg.solve(normal, lack[..., None])[..., 0]
    return places
