"""Where the tool is and where things are, told together from distances: an extended Kalman filter over one history.

A distance carries no bearing, but things at rest lie where they lay: each step of the tool, told roughly by what was
asked, shows all their bearings a little, and all their distances tell in turn how the tool really moved.
"""

from collections import deque

import numpy as np

__all__ = ["RangeMap"]

Array = np.ndarray

RANGE_STD_M = 0.001
HEIGHT_STD_M = 0.0005
GATE = 4.0
"""Standard deviations beyond which a distance contradicts that its thing rested."""
MOST_MOVE = 0.34
"""Where more than this share of the things seem to have moved at once, it was the tool."""
SETTLE_M = 0.01
"""What a thing that moved, or a tool that did not move as told, may be off at least."""
CARRIED_M = 0.005
RELEASED_M = 0.015
"""What comes along keeps its distance; once it has changed by so much, it does so no longer."""
N_ITERATIONS = 2
TINY = 1e-9


class RangeMap:
    """Mean and covariance of the tool's place and of every thing's, in the frame where the history began.

    The plane's axes are those of the intents; z is the height over the table where that is measured. Arrays over
    entries of P have a row for every entry; those that are no thing's are never looked at.
    """

    def __init__(self, guess: Array, std_m: Array, *, height_m: float, is_thing: Array, window: int) -> None:
        """Begin a history.

        Args:
            guess: Displacement from the tool to each thing, metres, (n, 3).
            std_m: How wrong it may be, standard deviation of an axis, metres, (n,).
            height_m: Height of the tool, metres.
            is_thing: Which entries are distances of things, (n,).
            window: Time steps from which it is told what comes along with the tool.
        """
        n = len(guess)
        self._is_thing = is_thing
        self._mean = np.zeros((n + 1, 3))
        self._mean[0, 2] = height_m
        self._mean[1:] = self._mean[0] + guess
        self._cov = np.diag(np.concatenate([np.full(3, TINY), np.repeat(std_m**2, 3)]))
        self._has_moved = np.zeros(n, dtype=bool)
        self._held_m = np.full(n, np.nan)
        """Distances of what comes along."""
        self._past: deque[tuple[Array, Array]] = deque(maxlen=window)
        """Places of the tool and the distances there; infinite where they speak of a thing no longer."""

    @property
    def place_m(self) -> Array:
        """Where the tool is, (3,)."""
        return self._mean[0]

    @property
    def things_m(self) -> Array:
        """Where things are, (n, 3)."""
        return self._mean[1:]

    @property
    def rested(self) -> Array:
        """Which things were never seen to move in this history, (n,)."""
        return self._is_thing & ~self._has_moved

    @property
    def carried(self) -> Array:
        """Which things come along with the tool, (n,)."""
        return np.isfinite(self._held_m)

    def doubt_m2(self) -> Array:
        """Return how unsure each thing's displacement from the tool is, mean variance of an axis.  -> (n,)"""
        n = len(self._mean)
        cov = self._cov.reshape(n, 3, n, 3)
        own = np.einsum("iaia->i", cov)
        return (own[1:] + own[0] - 2.0 * np.einsum("iaa->i", cov[1:, :, 0])) / 3.0

    def move(self, step_m: Array, std_m: float) -> None:
        """The tool was asked to move: the expected displacement, (3,), and its standard deviation of an axis."""
        self._mean[0] += step_m
        self._cov[range(3), range(3)] += std_m**2

    def see(self, distances_m: Array, height_m: float | None) -> None:
        """Take in the distances there are now, (n,), and the height where it is measured."""
        if height_m is not None:
            self._correct_height(height_m)
        self._release(distances_m)
        used = np.flatnonzero(self._is_thing & ~self.carried)
        if len(used):
            self._loosen(used, distances_m[used])
            self._correct(used, distances_m[used])
        self._find_carried(distances_m)

    def _correct_height(self, height_m: float) -> None:
        column = self._cov[:, 2].copy()
        gain = column / (column[2] + HEIGHT_STD_M**2)
        self._mean += (gain * (height_m - self._mean[0, 2])).reshape(-1, 3)
        self._cov -= np.outer(gain, column)

    # ---------------------------------------------------------------------------------------------------- distances

    def _rays(self, used: Array, mean: Array) -> tuple[Array, Array]:
        """Return distances by a mean, and the directions to the things.  -> (u,), (u, 3)"""
        o = mean[used + 1] - mean[0]
        d = np.sqrt(np.einsum("ij,ij->i", o, o) + TINY)
        return d, o / d[:, None]

    def _spread(self, used: Array, rays: Array) -> tuple[Array, Array]:
        """Return the covariance of everything with distances, and theirs with one another.  -> (3n + 3, u), (u, u)"""
        columns = self._cov.reshape(len(self._cov), -1, 3)
        with_all = np.einsum("kua,ua->ku", columns[:, used + 1] - columns[:, :1], rays)
        rows = with_all.reshape(-1, 3, len(used))
        return with_all, np.einsum("uav,ua->uv", rows[used + 1] - rows[:1], rays)

    def _noise(self, used: Array, along: Array, distances_m: Array) -> Array:
        """Return the variance of each distance: what is measured, and what a straight slope leaves out of a curve.

        The distance to a thing whose bearing is unsure by a variance v across the ray is longer by v / 2d.

        Args:
            used: Rows of the things.
            along: Variance along the rays, (u,).
            distances_m: What was seen, (u,).
        """
        across = np.maximum(3.0 * self.doubt_m2()[used] - along, 0.0)
        return RANGE_STD_M**2 + (0.5 * across / np.maximum(distances_m, SETTLE_M)) ** 2

    def _correct(self, used: Array, seen: Array) -> None:
        """Iterated Kalman update: the slopes are taken anew where the last iteration led."""
        prior = mean = self._mean
        d, rays = self._rays(used, mean)
        with_all, s = self._spread(used, rays)
        noise = np.diag(self._noise(used, s.diagonal(), seen))
        gain = np.linalg.solve(s + noise, with_all.T).T
        for _ in range(N_ITERATIONS - 1):
            mean = prior + (gain @ (seen - d)).reshape(-1, 3)
            d, rays = self._rays(used, mean)
            with_all, s = self._spread(used, rays)
            gain = np.linalg.solve(s + noise, with_all.T).T
            back = prior - mean
            d = d + np.einsum("ua,ua->u", rays, back[used + 1] - back[0])
        self._mean = prior + (gain @ (seen - d)).reshape(-1, 3)
        cov = self._cov - gain @ with_all.T
        self._cov = 0.5 * (cov + cov.T)

    # ------------------------------------------------------------------------------------------------- what moved

    def _loosen(self, used: Array, seen: Array) -> None:
        """Loosen what contradicts that it rested: a thing, or the tool where most things seem to have moved."""
        d, rays = self._rays(used, self._mean)
        along = self._spread(used, rays)[1].diagonal()
        lack = np.abs(seen - d)
        off = lack > GATE * np.sqrt(along + self._noise(used, along, seen))
        if not off.any():
            return
        if off.mean() > MOST_MOVE:
            self._cov[range(2), range(2)] += float(lack[off].max()) ** 2 + SETTLE_M**2
            return
        for i in np.flatnonzero(off):
            self._lay(int(used[i]), rays[i] * seen[i], float(min(lack[i], seen[i])) + SETTLE_M)
            self._has_moved[used[i]] = True

    def _lay(self, j: int, o: Array, std_m: float) -> None:
        """Forget where a thing was: it is displaced from the tool by o, give or take."""
        k = slice(3 * j + 3, 3 * j + 6)
        self._mean[j + 1] = self._mean[0] + o
        self._cov[k, :] = self._cov[:3, :]
        self._cov[:, k] = self._cov[:, :3]
        self._cov[k, k] = self._cov[:3, :3] + np.eye(3) * std_m**2

    def _release(self, distances_m: Array) -> None:
        """What came along and has changed its distance was let go: it is somewhere near."""
        for j in np.flatnonzero(self.carried & (np.abs(distances_m - self._held_m) > RELEASED_M)):
            self._held_m[j] = np.nan
            self._lay(int(j), np.array([0.0, 0.0, -distances_m[j]]), float(distances_m[j]) + SETTLE_M)
            for _, then in self._past:
                then[j] = np.inf

    def _find_carried(self, distances_m: Array) -> None:
        """The triangle inequality |x| <= d_then + d_now forbids that a thing rested which stayed near on a long way."""
        self._past.append((self._mean[0].copy(), distances_m.copy()))
        ways = np.array([place for place, _ in self._past]) - self._mean[0]
        then = np.array([d for _, d in self._past])
        longer = np.sqrt(np.einsum("ij,ij->i", ways, ways))[:, None] > then + distances_m + CARRIED_M
        found = self._is_thing & ~self.carried & longer.any(axis=0)
        self._held_m[found] = distances_m[found]
        self._has_moved |= found
        for j in np.flatnonzero(self.carried):
            self._mean[j + 1] = self._mean[0] + (0.0, 0.0, -distances_m[j])
