"""What the twin's arm did after the last good intent: when its ramp began, when it rested, how far it went. Pure."""

import msgspec
import numpy as np

from config.limits import Stopping
from robot.kinematics import ToolChain
from sim_twin.broken.judge import LAG_S, STILL_RAD_S
from sim_twin.controller.motion.poses import Array

__all__ = ["RAMP_S", "Ramp", "judge_ramp", "predicted_m"]

RAMP_S = 0.12
"""How long after the last good intent the arm may go on as it went."""
BRAKING_M_S2, HALF = 0.5, 0.5
"""A ramp is where the tool loses speed without a pause, by more than this, until it has lost half of it and more."""
SMOOTH = 2
"""Speeds and decelerations are taken over so many slices to either side."""


class Ramp(msgspec.Struct, frozen=True, kw_only=True):
    """A stop, from the last good intent on. Infinite where it never came."""

    speed_m_s: float
    """Of the tool before."""
    ramp_s: float
    """Until the tool began to slow down for good: from then on it lost speed without a pause."""
    rest_s: float
    """Until every joint was slower than 0.01 rad/s for good."""
    way_m: float
    """How far the tool came."""
    predicted_m: float
    """How far it may come: on for the time that a ramp may take to begin, and the stop of the limits file."""
    overshoot_rad: float
    """How far a joint came back from beyond where it rested."""
    after_rad: float
    """Farthest that a joint moved once it rested."""


def predicted_m(speed_m_s: float, stopping: Stopping) -> float:
    """Return how far a tool may come from the last good intent on: v t + v² / 2 a, and what the servos trail."""
    return speed_m_s * (RAMP_S + LAG_S) + speed_m_s**2 / (2.0 * stopping.deceleration_m_s2)


def judge_ramp(
    t_s: Array, q_rad: Array, qd_rad_s: Array, *, last_s: float, chain: ToolChain, stopping: Stopping
) -> Ramp:
    """Judge a stop by the physics' joints.

    Args:
        t_s: times, from before the last good intent until whatever comes after the stop, s.  (n,)
        q_rad: joints.  (n, 6)
        qd_rad_s: their speeds.  (n, 6)
        last_s: when the last good intent was sent.
        chain: the tool.
        stopping: of the limits profile.
    """
    tool_m = np.array([chain.tcp((a, b, c, d, e, f)) for a, b, c, d, e, f in q_rad.tolist()])  # (n, 3)
    at_s, speed = _rate(t_s, tool_m)  # (n - 2 SMOOTH,)
    k_sent = int(np.searchsorted(at_s, last_s))
    cruise = float(speed[k_sent])
    moving = np.flatnonzero(np.abs(qd_rad_s).max(axis=1) >= STILL_RAD_S)
    k_ramp, k_rest = _ramp(at_s, speed, k_sent), int(moving[-1]) + 1 if len(moving) else 0
    is_resting = k_ramp < len(at_s) and k_rest < len(t_s)
    if not is_resting:
        endless = float("inf")
        return Ramp(
            speed_m_s=cruise, ramp_s=endless, rest_s=endless, way_m=endless,
            predicted_m=predicted_m(cruise, stopping), overshoot_rad=endless, after_rad=endless,
        )  # fmt: skip
    k_last = int(np.searchsorted(t_s, last_s))
    rest_q = q_rad[-1]
    way = rest_q - q_rad[k_last]
    beyond = (q_rad[k_last:] - rest_q) * np.sign(way)
    return Ramp(
        speed_m_s=cruise,
        ramp_s=float(at_s[k_ramp] - last_s),
        rest_s=float(t_s[k_rest] - last_s),
        way_m=float(np.linalg.norm(np.diff(tool_m[k_last:], axis=0), axis=1).sum()),
        predicted_m=predicted_m(cruise, stopping),
        overshoot_rad=max(0.0, float(beyond.max())),
        after_rad=float(np.abs(q_rad[k_rest:] - q_rad[k_rest]).max()),
    )


def _rate(t_s: Array, x: Array) -> tuple[Array, Array]:
    """Return how fast x goes, and when.  (n,), (n, k) -> (n - 2 SMOOTH,) twice"""
    span_s = t_s[2 * SMOOTH :] - t_s[: -2 * SMOOTH]
    went = np.linalg.norm(x[2 * SMOOTH :] - x[: -2 * SMOOTH], axis=1)
    return t_s[SMOOTH:-SMOOTH], went / np.maximum(span_s, 1e-4)


def _ramp(t_s: Array, speed: Array, k_sent: int) -> int:
    """Return where the tool began to lose speed without a pause; the end where it has not lost half of it.

    Args:
        t_s: times.  (n,)
        speed: the tool's.  (n,)
        k_sent: where the last good intent was sent.
    """
    k_half = int(np.flatnonzero(speed >= HALF * speed[k_sent])[-1]) + 1
    if k_half >= len(speed):
        return len(speed)
    smooth = np.convolve(np.gradient(speed, t_s), np.full(2 * SMOOTH + 1, 1.0 / (2 * SMOOTH + 1)), mode="same")
    lasting = np.flatnonzero(smooth[:k_half] > -BRAKING_M_S2)
    return int(lasting[-1]) + 1 if len(lasting) else 0
