"""Where a fixed camera is and how a board sits in the hand, from poses of the tool and of the board. Pure maths.

For every view T_bt T_to = T_bc T_co. Between views i and j: A X = X B with X = T_bc, A = T_bt_j T_bt_i^-1 and
B = T_co_j T_co_i^-1. F. C. Park, B. J. Martin, "Robot sensor calibration: solving AX = XB on the Euclidean group",
IEEE Trans. Robotics and Automation 10(5), 1994: turns from logarithms, then positions by linear least squares.
OpenCV 5.0.0 lacks such a solver.
"""

from itertools import combinations

import numpy as np

from perception.calibration.lens import Array
from perception.calibration.poses import inverse, mean_transform, nearest_turn, rotation_vector, transform

__all__ = ["HandEye", "axes_deg", "solve_hand_eye"]


class HandEye:
    """A closed-form answer.

    Attributes:
        T_bc: The camera in the arm's base frame.
        T_to: The board in the tool's frame.
        scale: What the board's lengths would have to be multiplied by to agree with the arm's.
    """

    def __init__(self, T_bc: Array, T_to: Array, scale: float) -> None:
        self.T_bc, self.T_to, self.scale = T_bc, T_to, scale


def solve_hand_eye(T_bt: list[Array], T_co: list[Array]) -> HandEye:
    """Return camera and board from three views or more whose turns between them have two axes at least."""
    moved = [b @ inverse(a) for a, b in combinations(T_bt, 2)]
    seen = [b @ inverse(a) for a, b in combinations(T_co, 2)]
    alpha = np.array([rotation_vector(T[:3, :3]) for T in moved])
    beta = np.array([rotation_vector(T[:3, :3]) for T in seen])
    # Equation 24, (M^T M)^-1/2 M^T with M = sum beta alpha^T, by singular values: a turn also where M is singular.
    R_bc = nearest_turn(alpha.T @ beta)
    scale, position = _position(moved, seen, R_bc)
    T_bc = transform(R_bc, position)
    T_to = mean_transform([inverse(t) @ T_bc @ o for t, o in zip(T_bt, T_co, strict=True)])
    return HandEye(T_bc, T_to, scale)


def axes_deg(T_bt: list[Array]) -> tuple[float, float, float]:
    """Return how far a tool turned between views, rms about the most, the next and the least turned axis."""
    turns = np.array([rotation_vector((b @ inverse(a))[:3, :3]) for a, b in combinations(T_bt, 2)])
    values = np.degrees(np.linalg.svd(turns, compute_uv=False) / np.sqrt(len(turns)))
    padded = [*values.tolist(), 0.0, 0.0, 0.0]
    return padded[0], padded[1], padded[2]


def _position(moved: list[Array], seen: list[Array], R_bc: Array) -> tuple[float, Array]:
    """Return scale and position: (R_A - 1) t = R_bc t_B - t_A; the scale apart, with s t_B for t_B."""
    rows = np.concatenate([T[:3, :3] - np.eye(3) for T in moved])
    t_seen = np.concatenate([R_bc @ T[:3, 3] for T in seen])
    t_moved = np.concatenate([T[:3, 3] for T in moved])
    both = np.linalg.lstsq(np.column_stack([rows, -t_seen]), -t_moved, rcond=None)[0]
    position = np.linalg.lstsq(rows, t_seen - t_moved, rcond=None)[0]
    return float(both[3]), position.astype(np.float64)
