"""What trials are worth to who knows how probable it is that each goal is allowed in each goal-state. Pure.

Goal-states are bit masks; a trial at a goal achieves it with its skill where it is allowed, and else changes nothing.
"""

import numpy as np

__all__ = ["TRIAL_COST", "after", "information", "worth_of_information", "worth_of_success"]

TRIAL_COST = 0.01
"""Of success, so that of two ways that are as sure the shorter one is worth more."""


def after(n_goals: int) -> np.ndarray:
    """Return the goal-state after achieving each goal in each goal-state; -1 where it was achieved.  () -> (n, 2^n)"""
    states, bits = np.arange(1 << n_goals), 1 << np.arange(n_goals)[:, None]
    return np.where(states & bits, -1, states | bits)


def information(allowed: np.ndarray, if_allowed: np.ndarray, if_not: np.ndarray) -> np.ndarray:
    """Return the mutual information, in nats, of a trial's outcome and whether its goal is allowed.

    It is the sum over outcomes of p a log a + (1 - p) b log b - m log m with m = p a + (1 - p) b: all that a trial can
    tell of the rules.

    Args:
        allowed: p, chances that goals are allowed.  (..., s)
        if_allowed: a, the chance of each outcome where it is.  (..., o)
        if_not: b, the same where it is not.  (..., o)
    """
    told = np.zeros_like(allowed)
    blocked = 1.0 - allowed
    for a, b in zip(np.moveaxis(if_allowed, -1, 0), np.moveaxis(if_not, -1, 0), strict=True):
        mixed = allowed * a[..., None] + blocked * b[..., None]
        logarithm = np.log(mixed, out=np.zeros_like(mixed), where=mixed > 0.0)
        told += allowed * _entropic(a)[..., None] + blocked * _entropic(b)[..., None] - mixed * logarithm
    return told


def _entropic(chance: np.ndarray) -> np.ndarray:
    """Return a log a, nothing where a is none."""
    return chance * np.log(chance, out=np.zeros_like(chance), where=chance > 0.0)


def worth_of_information(
    told: np.ndarray, achieved: np.ndarray, following: np.ndarray, *, price: float, goal: int | None, n_trials: int
) -> np.ndarray:
    """Return what each first trial is worth: its information and that of the best ones after it, less their price.

    What follows a failure is not counted: it is found out anew then.

    Args:
        told: information of a trial at each goal in each goal-state, nats.  (n, 2^n)
        achieved: its chance of success.  (n, 2^n)
        following: `after`.
        price: of one trial, nats; who finds nothing that is worth it had better stop.
        goal: with which the epoch ends; None where it never does.
        n_trials: that are left.

    Returns:
        Worth, -inf where the goal is achieved already.  (n, 2^n)
    """
    best = np.zeros(told.shape[1])
    worth = np.where(following < 0, -np.inf, told - price)
    for _ in range(n_trials - 1):
        best = np.maximum(worth.max(axis=0), 0.0)
        if goal is not None:
            best[np.arange(len(best)) >> goal & 1 == 1] = 0.0
        worth = np.where(following < 0, -np.inf, told - price + achieved * best[following])
    return worth


def worth_of_success(achieved: np.ndarray, following: np.ndarray, *, goal: int, n_trials: int) -> np.ndarray:
    """Return how sure each first trial makes it that a goal is achieved, less the cost of trials.

    Args:
        achieved: chance of success of a trial at each goal in each goal-state.  (n, 2^n)
        following: `after`.
        goal: the wanted one.
        n_trials: that are left.

    Returns:
        Worth, -inf where the goal is achieved already.  (n, 2^n)
    """
    is_there = np.arange(achieved.shape[1]) >> goal & 1 == 1
    best = is_there.astype(float)
    worth = np.zeros_like(achieved)
    for _ in range(n_trials):
        worth = np.where(following < 0, -np.inf, achieved * best[following] + (1.0 - achieved) * best - TRIAL_COST)
        best = np.where(is_there, 1.0, worth.max(axis=0))
    return worth
