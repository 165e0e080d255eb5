"""Lengths and twists of one arm, by where its controller says the tool is at the joints that it says. Maths.

Where axes are parallel, as those of shoulder, elbow and wrist 1 nearly are, their offsets along them are told only in
sum: the interval of each is wide then, that of the sum is not.
"""

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from config.arm import ArmConfig
from config.fitted import RowOff
from sim_twin.fitting.stream import Piece

__all__ = ["FIELDS", "Lengths", "fit_lengths", "tool_of"]

Array = NDArray[np.float64]
FIELDS = ("a_m", "d_m", "alpha_rad", "theta_rad")
N = 6 * len(FIELDS)
LEAST_M, LEAST_RAD = 1e-6, 1e-6
"""What a controller's word is not better than."""
LIKELY = 5e-3
"""How far a value may well be off, m or rad."""
TOLD = 5e-4
"""A value is told where its interval is so much or less."""
MOST_ROWS, N_STEPS, STEP = 300, 6, 1e-6
LEAST_ROWS = 30
PARALLEL = tuple(4 * row + 1 for row in (1, 2, 3))
"""Offsets of shoulder, elbow and wrist 1 along their axes."""
Z = float(norm.ppf(0.975))


class Lengths(msgspec.Struct, frozen=True, kw_only=True, eq=False):
    """What came of it. Vectors have FIELDS of each row."""

    x: Array
    half: Array
    """Of the 95 % interval; infinite where a value is not told."""
    sum_d_m: float
    """Of the offsets along the parallel axes."""
    sum_half_m: float
    left_m: float
    """Greatest distance of where the tool is said to be from where the fitted rows have it."""
    before_m: float
    """The same of the file's rows."""

    @property
    def rows(self) -> tuple[RowOff, ...]:
        """The offsets as config has them."""
        return tuple(RowOff(**dict(zip(FIELDS, row, strict=True))) for row in self.x.reshape(6, 4).tolist())


def fit_lengths(arm: ArmConfig, pieces: Sequence[Piece]) -> Lengths | None:
    """Fit rows to poses of the tool; None where there are too few, or they do not turn.

    The tool itself is taken to be as the file has it.
    """
    q, place, quat = (
        np.concatenate([getattr(p, name)[p.seen] for p in pieces]) for name in ("q_rad", "tcp_m", "tcp_quat")
    )
    every = max(1, len(q) // MOST_ROWS)
    q, place, quat = q[::every], place[::every], quat[::every]
    if len(q) < LEAST_ROWS or float(np.ptp(quat, axis=0).max()) < 1e-9:
        return None
    turn = _matrices(quat)
    x: Array = np.zeros(N)
    before_m = _greatest(arm, x, q, place)
    for _ in range(N_STEPS):
        r, J = _errors(arm, x, q, place, turn), _slopes(arm, x, q, place, turn)
        noise = _noise(r)
        J_n, r_n = J / noise, r / noise.ravel()
        # What nobody looked for is known within what is likely: else offsets that are told in sum alone run away.
        x = np.asarray(np.linalg.solve(J_n.T @ J_n + np.eye(N) / LIKELY**2, J_n.T @ (J_n @ x - r_n)), np.float64)
    noise = _noise(_errors(arm, x, q, place, turn))
    J_n = _slopes(arm, x, q, place, turn) / noise
    covariance = np.linalg.inv(J_n.T @ J_n + np.eye(N) / LIKELY**2)
    half = Z * np.sqrt(np.diag(covariance))
    together = np.zeros(N)
    together[list(PARALLEL)] = 1.0
    return Lengths(
        x=x, half=np.where(half <= TOLD, half, np.inf), sum_d_m=float(together @ x),
        sum_half_m=float(Z * np.sqrt(together @ covariance @ together)), left_m=_greatest(arm, x, q, place),
        before_m=before_m,
    )  # fmt: skip


def tool_of(arm: ArmConfig, x: Array, q_rad: Array) -> tuple[Array, Array]:
    """Return places and turns of the tool, with offsets of the rows.  (24,), (n, 6) -> (n, 3), (n, 3, 3)"""
    R, p = np.broadcast_to(np.eye(3), (len(q_rad), 3, 3)), np.zeros((len(q_rad), 3))
    for joint, off, q in zip(arm.joints, x.reshape(6, 4), q_rad.T, strict=True):
        a, d, alpha = joint.a_m + off[0], joint.d_m + off[1], joint.alpha_rad + off[2]
        c, s, ca, sa = np.cos(q + off[3]), np.sin(q + off[3]), np.cos(alpha), np.sin(alpha)
        zero = np.zeros_like(c)
        step = np.stack([c, -s * ca, s * sa, s, c * ca, -c * sa, zero, zero + sa, zero + ca], axis=1).reshape(-1, 3, 3)
        p = p + np.einsum("nij,nj->ni", R, np.stack([a * c, a * s, zero + d], axis=1))
        R = R @ step
    return p + R @ np.array(arm.tool.tcp_m), R


def _errors(arm: ArmConfig, x: Array, q: Array, place: Array, turn: Array) -> Array:
    """Return places, and turns as small vectors, off what was told.  () -> (6 n,)"""
    p, R = tool_of(arm, x, q)
    off = np.einsum("nji,njk->nik", turn, R)
    vector = 0.5 * np.stack([off[:, 2, 1] - off[:, 1, 2], off[:, 0, 2] - off[:, 2, 0], off[:, 1, 0] - off[:, 0, 1]], 1)
    return np.concatenate([(p - place).ravel(), vector.ravel()])


def _slopes(arm: ArmConfig, x: Array, q: Array, place: Array, turn: Array) -> Array:
    def at(step: Array) -> Array:
        return _errors(arm, x + step, q, place, turn)

    return np.stack([(at(e) - at(-e)) / (2.0 * STEP) for e in STEP * np.eye(N)], axis=1)


def _noise(r: Array) -> Array:
    """Return what places and turns are off by, (6 n, 1)."""
    half = len(r) // 2
    place, turn = max(LEAST_M, float(r[:half].std())), max(LEAST_RAD, float(r[half:].std()))
    return np.concatenate([np.full(half, place), np.full(half, turn)]).reshape(-1, 1)


def _greatest(arm: ArmConfig, x: Array, q: Array, place: Array) -> float:
    return float(np.linalg.norm(tool_of(arm, x, q)[0] - place, axis=1).max())


def _matrices(quat: Array) -> Array:
    """Return rotation matrices.  (n, 4) -> (n, 3, 3)"""
    w, x, y, z = quat.T
    return np.stack(
        [
            1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
        ], axis=1,
    ).reshape(-1, 3, 3)  # fmt: skip
