"""Least squares on joints, what a session can tell of each value, and how surely. Maths.

The solver is mujoco.minimize, which mujoco.sysid stands on. Intervals are those of least squares with the noise of each
joint as it was found, made wider where what is left is not noise: errors that last are counted by Newey and West's sum
over lags (Econometrica 55, 1987), for the same error a hundred times over is not a hundred errors.
"""

from collections.abc import Callable, Sequence

import msgspec
import numpy as np
from mujoco import minimize
from numpy.typing import NDArray
from scipy.stats import norm

from sim_twin.fitting.model import ArmAlone
from sim_twin.fitting.stream import Piece
from sim_twin.fitting.values import N_VALUES, VALUES

__all__ = ["Estimate", "estimate", "joint_errors"]

Array = NDArray[np.float64]
BURN_S = 0.3
"""After the beginning of a piece, until the arm has forgotten how it began."""
LEAST_NOISE_RAD = 1e-5
"""What no encoder of such an arm is better than."""
TOLD_SHARE = 0.2
"""A value is told where its interval is this share of how far off it may well be, or less."""
LASTING_S = 0.1
"""Errors that last so long are counted as what they are."""
Z = float(norm.ppf(0.975))
MAX_ITER = 30
FEW, FEW_S, ROUGHLY, CLOSELY = 2, 1.0, 0.01, 1e-4
"""The way to the solution's neighbourhood is found on the beginnings of two pieces; where it ends, and the other, in
scales of values."""
_SCALES = np.array([v.scale for v in VALUES])
_STEPS = np.array([v.step for v in VALUES])
_STARTS = np.array([v.inside for v in VALUES]).T
"""(n, N_VALUES) where fits begin at least: a smoothing that is nothing looks like a delay to whoever asks what a little
more of it would do."""
SOLVED_TO = 1.15
"""Times its noise that a joint is off at a solution; where more is left another start is tried."""
_BOUNDS = np.array([(v.low, v.high) for v in VALUES])


class Estimate(msgspec.Struct, frozen=True, kw_only=True, eq=False):
    """What came of a fit. Vectors are in the order of VALUES."""

    x: Array
    half: Array
    """Of the 95 % interval; infinite where a value is not told."""
    told: tuple[bool, ...]
    why: tuple[str, ...]
    """Why a value is not told; empty where it is."""
    noise_rad: Array
    """(6,) standard deviation of what is left."""


def joint_errors(arm: ArmAlone, x: Array, pieces: Sequence[Piece]) -> Array:
    """Return measured less simulated joints after the beginnings of pieces.  (N_VALUES,) -> (n, 6)"""
    n_burn = _burn(pieces)
    each = [(p.q_rad - arm.joints(x[None], p)[0]) * p.seen[:, None] for p in pieces]
    return np.concatenate([errors[n_burn:] for errors in each])


def estimate(arm: ArmAlone, x0: Array, pieces: Sequence[Piece]) -> Estimate:
    """Fit what pieces tell.

    Args:
        arm: makes joints of values.
        x0: (N_VALUES,) to begin with; what is not told stays about there.
        pieces: at least one, of more than its beginning.
    """
    quiet = _noise(pieces)
    best: tuple[float, Array] | None = None
    for start in _STARTS:
        x = _fitted(arm, x0, np.maximum(x0, start), [p.head(FEW_S) for p in pieces[:FEW]], quiet, closely=ROUGHLY)
        x = _fitted(arm, x0, x, pieces, quiet, closely=CLOSELY)
        left = float((joint_errors(arm, x, pieces).std(axis=0) / quiet).max())
        if best is None or left < best[0]:
            best = left, x
        if left < SOLVED_TO:
            break
    assert best is not None, "there are starts"
    x = best[1]
    noise = np.maximum(LEAST_NOISE_RAD, joint_errors(arm, x, pieces).std(axis=0))
    J = _jacobian(arm, x, pieces, noise)
    why = _reasons(J)
    half = np.full(N_VALUES, np.inf)
    inner = [k for k in range(N_VALUES) if not _is_at_bound(x, k)]
    errors = joint_errors(arm, x, pieces) / noise
    half[inner] = Z * np.sqrt(_spread(J[:, :, inner], _SCALES[inner], errors, _lasting(pieces)))
    for k in set(range(N_VALUES)) - set(inner):  # held by its bound: as far as it would be told without
        half[k] = Z * np.sqrt(_spread(J[:, :, [k]], _SCALES[[k]], errors, _lasting(pieces))[0])
    told = half <= TOLD_SHARE * _SCALES
    for k in np.flatnonzero(told):
        why[k] = ""
    for k in np.flatnonzero(~told):
        why[k] = why[k] or f"not closer than ± {half[k]:.2g} {VALUES[k].unit}"
        half[k] = np.inf
    return Estimate(x=x, half=half, told=tuple(told.tolist()), why=tuple(why), noise_rad=noise)


def _fitted(arm: ArmAlone, x0: Array, begin: Array, pieces: Sequence[Piece], noise: Array, *, closely: float) -> Array:
    """Return the values that explain pieces best, each taken to be about where the file has it, within its scale."""

    def residual(z: Array) -> Array:
        """(k, n) -> (m, n)"""
        x = np.clip((z * _SCALES[:, None]).T, _BOUNDS[:, 0], _BOUNDS[:, 1])
        seen = _residuals(arm, x, pieces, noise).reshape(len(x), -1)
        return np.concatenate([seen, (x - x0) / _SCALES], axis=1).T

    low, high = _BOUNDS.T / _SCALES
    found, _ = minimize.least_squares(
        begin / _SCALES, residual, [low, high], jacobian=_by_steps(residual, high), max_iter=MAX_ITER, xtol=closely,
        verbose=minimize.Verbosity.SILENT,
    )  # fmt: skip
    return found.ravel() * _SCALES


def _by_steps(residual: Callable[[Array], Array], high: Array) -> Callable[[Array, Array], Array]:
    """Return what takes differences by each value's own step."""
    steps = _STEPS / _SCALES

    def jacobian(z: Array, r: Array) -> Array:
        signed = np.where(z.ravel() + steps > high, -steps, steps)
        return (residual(z + np.diag(signed)) - r) / signed

    return jacobian


def _residuals(arm: ArmAlone, x: Array, pieces: Sequence[Piece], noise: Array) -> Array:
    """Return simulated less measured joints in their noise.  (k, N_VALUES) -> (k, n, 6)"""
    n_burn = _burn(pieces)
    each = [(arm.joints(x, p) - p.q_rad) * p.seen[:, None] for p in pieces]
    return np.concatenate([errors[:, n_burn:] for errors in each], axis=1) / noise


def _jacobian(arm: ArmAlone, x: Array, pieces: Sequence[Piece], noise: Array) -> Array:
    """Return how joints change with each value, between both sides where bounds leave room.  () -> (n, 6, N_VALUES)"""
    up = np.minimum(x + _STEPS, _BOUNDS[:, 1])
    down = np.maximum(x - _STEPS, _BOUNDS[:, 0])
    both = np.tile(x, (2 * N_VALUES, 1))
    both[np.arange(N_VALUES), np.arange(N_VALUES)] = up
    both[N_VALUES + np.arange(N_VALUES), np.arange(N_VALUES)] = down
    r = _residuals(arm, both, pieces, noise)
    return np.moveaxis((r[:N_VALUES] - r[N_VALUES:]) / (up - down)[:, None, None], 0, -1)


def _reasons(J: Array) -> list[str]:
    """Return why values are not told by noise like what is left, empty for those that are.  (n, 6, N_VALUES)"""
    why = [""] * N_VALUES
    left = list(range(N_VALUES))
    scaled = J.reshape(-1, N_VALUES) * _SCALES
    information = scaled.T @ scaled
    while left:
        part = information[np.ix_(left, left)]
        covariance = np.asarray(np.linalg.inv(part + np.eye(len(left))), np.float64)
        half = Z * np.sqrt(np.diag(covariance))
        worst = int(np.argmax(half))
        if half[worst] <= TOLD_SHARE:
            break
        why[left[worst]] = _reason(part, covariance, left, worst)
        left.pop(worst)
    return why


def _reason(information: Array, covariance: Array, left: list[int], worst: int) -> str:
    if Z / np.sqrt(information[worst, worst] + 1e-300) > TOLD_SHARE:
        return "nothing in the session depends on it enough"
    spread = np.sqrt(np.diag(covariance))
    alike = np.abs(covariance[worst] / (spread[worst] * spread))
    alike[worst] = 0.0
    return f"not told apart from {VALUES[left[int(np.argmax(alike))]].name}"


def _spread(J: Array, scales: Array, errors: Array, n_lags: int) -> Array:
    """Return variances: those of independent errors, or those of errors that last, whichever is more.

    Args:
        J: (n, 6, k)
        scales: (k,) within which values were known before.
        errors: (n, 6), in their noise.
        n_lags: ticks.

    Returns:
        (k,)
    """
    size = np.maximum(np.sqrt(np.einsum("nik,nik->k", J, J)), 1e-12)
    J = J / size  # seconds and newton metres a radian are so far apart that an inverse would lose the one to the other
    information = np.einsum("nik,nil->kl", J, J) + np.diag(1.0 / (scales * size) ** 2)
    inverse = np.linalg.pinv(information, hermitian=True)
    scores = np.einsum("nik,ni->nk", J, errors)
    summed = scores.T @ scores
    for lag in range(1, n_lags + 1):
        both = scores[lag:].T @ scores[:-lag]
        summed += (1.0 - lag / (n_lags + 1.0)) * (both + both.T)
    return np.maximum(np.diag(inverse), np.diag(inverse @ summed @ inverse)) / size**2


def _noise(pieces: Sequence[Piece]) -> Array:
    """Return joints' noise by third differences, in which motion is hardly left.  () -> (6,)"""
    thirds = np.concatenate([np.diff(p.q_rad, n=3, axis=0) for p in pieces])
    return np.maximum(LEAST_NOISE_RAD, np.median(np.abs(thirds), axis=0) / 0.6745 / np.sqrt(20.0))


def _is_at_bound(x: Array, k: int) -> bool:
    low, high = _BOUNDS[k]
    return bool(min(x[k] - low, high - x[k]) < 1e-6 * _SCALES[k])


def _burn(pieces: Sequence[Piece]) -> int:
    return round(BURN_S / pieces[0].tick_s)


def _lasting(pieces: Sequence[Piece]) -> int:
    return max(1, round(LASTING_S / pieces[0].tick_s))
