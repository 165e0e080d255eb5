"""Non-linear least squares for a handful of unknowns. Pure maths.

K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for non-linear least squares problems", 2nd ed., DTU 2004, algorithm
3.16 (Levenberg-Marquardt with Nielsen's damping), with differences for the Jacobian.
"""

from collections.abc import Callable

import numpy as np

from perception.calibration.lens import Array

__all__ = ["Fit", "fit_least_squares", "jacobian_of"]

Residuals = Callable[[Array], Array]
STEP = 1e-6
MAX_ITERATIONS = 60
SMALL = 1e-12


class Fit:
    """What a least squares fit came to.

    Attributes:
        x: The unknowns.  (n,)
        residuals: What is left there.  (m,)
        covariance: Of the unknowns, from the residuals' own variance.  (n, n)
    """

    def __init__(self, x: Array, residuals: Array, J: Array) -> None:
        self.x, self.residuals = x, residuals
        spare = max(1, len(residuals) - len(x))
        self.covariance = np.linalg.pinv(J.T @ J) * float(residuals @ residuals) / spare


def fit_least_squares(residuals: Residuals, start: Array) -> Fit:
    """Return where the sum of squared residuals is least, near a start."""
    x, r = start.astype(np.float64), residuals(start)
    J = jacobian_of(residuals, x)
    damping, growth = 1e-3 * float(np.max(np.sum(J * J, axis=0))), 2.0
    for _ in range(MAX_ITERATIONS):
        normal, g = J.T @ J, J.T @ r
        step = np.linalg.solve(normal + damping * np.eye(len(x)), -g)
        if np.linalg.norm(step) <= SMALL * (np.linalg.norm(x) + SMALL):
            break
        r_new = residuals(x + step)
        gain = (r @ r - r_new @ r_new) / max(float(step @ (damping * step - g)), SMALL**2)
        if not gain > 0.0:  # asked this way round, what is not a number is no gain
            damping, growth = damping * growth, growth * 2.0
            continue
        is_settled = r @ r - r_new @ r_new <= SMALL * (r @ r)
        x, r = x + step, r_new
        if is_settled:
            break
        J = jacobian_of(residuals, x)
        damping, growth = damping * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 2.0
    return Fit(x, r, J)


def jacobian_of(residuals: Residuals, x: Array) -> Array:
    """Return how residuals change with the unknowns, by central differences.  (n,) -> (m, n)"""
    columns = []
    for i in range(len(x)):
        step = np.zeros(len(x))
        step[i] = STEP * max(1.0, abs(float(x[i])))
        columns.append((residuals(x + step) - residuals(x - step)) / (2.0 * step[i]))
    return np.stack(columns, axis=1)
