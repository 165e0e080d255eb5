"""Competence of one goal: equation (1) in its three readings, running success, temperature. Pure."""

from collections.abc import Sequence

import numpy as np

from config.learning import SubgoalSelection

__all__ = [
    "absolute_improvement",
    "clipped_success_improvement",
    "delta_competence",
    "has_dropped",
    "running_success",
    "subgoal_temperature",
]

DROP = 0.3
"""Fall of the success rate, newest half-window against the window before it, that counts as beginning to fail."""


def delta_competence(cp: Sequence[float], window: int) -> float:
    """Return ΔC^g, equation (1) as printed: mean |CP| of the newest window minus that of the one before.  (n,) -> ()

    CP_i is the expected probability of achieving g, said at the start of the trial, minus what came (1 or 0). The
    equation needs 2·PT attempts; before that nothing can be said about improvement, and 0 is returned.

    Args:
        cp: CP_i of the attempts at g, oldest first.
        window: PT.
    """
    return _newer_minus_older(np.abs(cp), window)


def clipped_success_improvement(results: Sequence[float], window: int) -> float:
    """Return max(0, newest window's mean success minus the mean of the window before); 0 before 2·PT.  (n,) -> ()"""
    return max(0.0, _newer_minus_older(np.asarray(results), window))


def absolute_improvement(results: Sequence[float], window: int) -> float:
    """Return the size of the change of mean success between two windows; 0 before 2·PT attempts.  (n,) -> ()"""
    return abs(_newer_minus_older(np.asarray(results), window))


def running_success(results: Sequence[float], window: int) -> float:
    """Return the mean of the newest results, at most a window of them; 0 where there is none.  (n,) -> ()"""
    newest = results[-window:]
    return sum(newest) / len(newest) if newest else 0.0


def has_dropped(results: Sequence[float], window: int) -> bool:
    """Whether success fell by more than DROP, newest half-window against the window before it.  (n,) -> ()"""
    half = max(1, window // 2)
    if len(results) < half + window:
        return False
    newest, before = results[-half:], results[-half - window : -half]
    return sum(before) / window - sum(newest) / half > DROP


def subgoal_temperature(selection: SubgoalSelection, *, improvement: float, success: float) -> float:
    """Return the temperature of the sub-goal choice: least + scale · (1 - ΔC or 1 - competence); fixed: least.

    The text of the paper says 1 - ΔC. ΔC may be negative, down to -1; the temperature stays at or above the least.
    """
    match selection.temperature:
        case "one_minus_improvement":
            noise = max(0.0, 1.0 - improvement)
        case "one_minus_competence":
            noise = 1.0 - success
        case "fixed":
            noise = 0.0
    return selection.temperature_least + selection.temperature_scale * noise


def _newer_minus_older(values: np.ndarray, window: int) -> float:
    if len(values) < 2 * window:
        return 0.0
    return float(values[-window:].mean() - values[-2 * window : -window].mean())
