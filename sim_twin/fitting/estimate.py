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
MISFIT = 3.0
"""Before anything is fitted, for what may be left beside noise."""
LASTING_S = 0.1
"""Errors that last so long are counted as what they are."""
Z = float(norm.ppf(0.975))
MAX_ITER = 30
FEW, FEW_S, ROUGHLY, CLOSELY = 1, 1.5, 0.01, 1e-4
"""The way to the solution's neighbourhood is found on the beginning of one piece; where it ends, and the other, in
scales of values."""
_SCALES = np.array([v.scale for v in VALUES])
_STEPS = np.array([v.step for v in VALUES])
_INSIDE = np.array([v.inside for v in VALUES])
"""A smoothing that is nothing looks like a delay to whoever asks what a little more of it would do."""
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
        x0: (N_VALUES,) to begin with; what is not told stays so.
        pieces: at least one, of more than its beginning.
    """
    noise = _noise(pieces)
    x = np.maximum(x0, _INSIDE)
    told, _ = _told(_jacobian(arm, x, pieces, noise, is_quick=True))
    x = _fitted(arm, _with(x0, x, told), told, [p.head(FEW_S) for p in pieces[:FEW]], noise, closely=ROUGHLY)
    noise = np.maximum(LEAST_NOISE_RAD, joint_errors(arm, x, pieces).std(axis=0))
    # What can be told is asked once more where the solution is: it may be told apart there.
    told, why = _told(_jacobian(arm, np.maximum(x, _INSIDE), pieces, noise, is_quick=True))
    x = _fitted(arm, _with(x0, x, told), told, pieces, noise, closely=CLOSELY)
    noise = np.maximum(LEAST_NOISE_RAD, joint_errors(arm, x, pieces).std(axis=0))
    inner = [k for k in told if not _is_at_bound(x, k)]
    if len(inner) < len(told):  # a bound is a corner, which the way to a solution gets caught in
        x = _fitted(arm, x, inner, pieces, noise, closely=CLOSELY)
        noise = np.maximum(LEAST_NOISE_RAD, joint_errors(arm, x, pieces).std(axis=0))
        inner = [k for k in inner if not _is_at_bound(x, k)]
    errors = joint_errors(arm, x, pieces) / noise
    J = _jacobian(arm, x, pieces, noise)
    half = np.full(N_VALUES, np.inf)
    half[inner] = Z * np.sqrt(_spread(J[:, :, inner], errors, _lasting(pieces)))
    for k in set(told) - set(inner):  # held by its bound: as far as it would be told without
        half[k] = Z * np.sqrt(_spread(J[:, :, [k]], errors, _lasting(pieces))[0])
    for k in told:
        if half[k] > TOLD_SHARE * _SCALES[k]:
            why[k] = f"not closer than ± {half[k]:.2g} {VALUES[k].unit}"
            half[k] = np.inf
    final = tuple(bool(np.isfinite(h)) for h in half)
    return Estimate(x=x, half=half, told=final, why=tuple(why), noise_rad=noise)


def _fitted(
    arm: ArmAlone, x0: Array, told: list[int], pieces: Sequence[Piece], noise: Array, *, closely: float
) -> Array:
    scales = _SCALES[told]

    def residual(z: Array) -> Array:
        """(k, n) -> (m, n)"""
        x = np.tile(x0, (z.shape[1], 1))
        x[:, told] = (z * scales[:, None]).T
        x = np.clip(x, _BOUNDS[:, 0], _BOUNDS[:, 1])
        return _residuals(arm, x, pieces, noise).reshape(len(x), -1).T

    low, high = _BOUNDS[told].T / scales
    found, _ = minimize.least_squares(
        x0[told] / scales, residual, [low, high], jacobian=_by_steps(residual, told, high), max_iter=MAX_ITER,
        xtol=closely, verbose=minimize.Verbosity.SILENT,
    )  # fmt: skip
    x = x0.copy()
    x[told] = found.ravel() * scales
    return x


def _by_steps(
    residual: Callable[[Array], Array], told: list[int], high: Array
) -> Callable[[Array, Array], Array]:  # fmt: skip
    """Return what takes differences by each value's own step."""
    steps = (_STEPS / _SCALES)[told]

    def jacobian(z: Array, r: Array) -> Array:
        signed = np.where(z.ravel() + steps > high, -steps, steps)
        return (residual(z + np.diag(signed)) - r) / signed

    return jacobian


def _residuals(arm: ArmAlone, x: Array, pieces: Sequence[Piece], noise: Array) -> Array:
    """Return simulated less measured joints in their noise.  (k, N_VALUES) -> (k, n, 6)"""
    n_burn = _burn(pieces)
    each = [(arm.joints(x, p) - p.q_rad) * p.seen[:, None] for p in pieces]
    return np.concatenate([errors[:, n_burn:] for errors in each], axis=1) / noise


def _jacobian(
    arm: ArmAlone, x: Array, pieces: Sequence[Piece], noise: Array, *, is_quick: bool = False
) -> Array:  # fmt: skip
    """Return how joints change with each value, between both sides where bounds leave room.  () -> (n, 6, N_VALUES)"""
    up = np.minimum(x + _STEPS, _BOUNDS[:, 1])
    down = np.maximum(x - _STEPS, _BOUNDS[:, 0])
    if is_quick:
        one = np.concatenate([np.tile(x, (N_VALUES, 1)) + np.diag(up - x), x[None]])
        r = _residuals(arm, one, pieces, noise)
        return np.moveaxis((r[:-1] - r[-1]) / (up - x)[:, None, None], 0, -1)
    both = np.tile(x, (2 * N_VALUES, 1))
    both[np.arange(N_VALUES), np.arange(N_VALUES)] = up
    both[N_VALUES + np.arange(N_VALUES), np.arange(N_VALUES)] = down
    r = _residuals(arm, both, pieces, noise)
    return np.moveaxis((r[:N_VALUES] - r[N_VALUES:]) / (up - down)[:, None, None], 0, -1)


def _with(x0: Array, x: Array, told: list[int]) -> Array:
    """Return values that are told, the others as they were before."""
    out = x0.copy()
    out[told] = x[told]
    return out


def _told(J: Array) -> tuple[list[int], list[str]]:
    """Return which values pieces tell, and why the others are not told.  (n, 6, N_VALUES)"""
    why = [""] * N_VALUES
    left = list(range(N_VALUES))
    scaled = J.reshape(-1, N_VALUES) * _SCALES / MISFIT
    information = scaled.T @ scaled
    while left:
        part = information[np.ix_(left, left)]
        # What nobody looked for is known within its scale already.
        covariance = np.asarray(np.linalg.inv(part + np.eye(len(left))), np.float64)
        half = Z * np.sqrt(np.diag(covariance))
        worst = int(np.argmax(half))
        if half[worst] <= TOLD_SHARE:
            break
        why[left[worst]] = _reason(part, covariance, left, worst)
        left.pop(worst)
    return left, why


def _reason(information: Array, covariance: Array, left: list[int], worst: int) -> str:
    if Z / np.sqrt(information[worst, worst] + 1e-300) > TOLD_SHARE:
        return "nothing in the session depends on it enough"
    spread = np.sqrt(np.diag(covariance))
    alike = np.abs(covariance[worst] / (spread[worst] * spread))
    alike[worst] = 0.0
    return f"not told apart from {VALUES[left[int(np.argmax(alike))]].name}"


def _spread(J: Array, errors: Array, n_lags: int) -> Array:
    """Return variances: those of independent errors, or those of errors that last, whichever is more.

    Args:
        J: (n, 6, k)
        errors: (n, 6), in their noise.
        n_lags: ticks.

    Returns:
        (k,)
    """
    size = np.maximum(np.sqrt(np.einsum("nik,nik->k", J, J)), 1e-300)
    J = J / size  # seconds and newton metres a radian are so far apart that an inverse would lose the one to the other
    inverse = np.linalg.pinv(np.einsum("nik,nil->kl", J, J), hermitian=True)
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
