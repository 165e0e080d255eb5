"""From what a driver asks to an intent: hold-to-run, clutch, frame, speed and a ramp from rest. State of one driver."""

import math

import msgspec

from robot.geometry import rotated
from robot.messages import Grip, Hold, Quat, Twist, Vec3
from robot.teleop.device import DriverInput, Frame

__all__ = ["Jog", "JogLimits", "Resting"]

Resting = str
"""Why a driver's arm rests, for a person: released, clutch, silent, wrong input; empty where it moves."""


class JogLimits(msgspec.Struct, frozen=True, kw_only=True):
    """How a driver drives."""

    full_m_s: float
    """Speed of the tool at a share of 1."""
    full_rad_s: float
    """Speed of its turn at a share of 1."""
    ramp_s: float
    """From rest to what is asked."""
    deadline_s: float
    """An input older than this is none: the arm comes to rest."""
    step_s: float
    """How long one intent lasts."""


class Jog:
    """Makes one intent a step. What it holds: how far the ramp is up, and what the hand was asked.

    The ramp begins at rest whenever motion begins: after arming, a release, a clutch, a change of frame, a silence.
    Going down is never ramped here: a Hold is sent at once, and motion brakes within the arm's limits.
    """

    def __init__(self, limits: JogLimits) -> None:
        self._limits = limits
        self._deadline_ns = round(limits.deadline_s * 1e9)
        self.reset()

    def reset(self) -> None:
        """Begin anew at rest, the hand as it is: after arming, or a hand-over."""
        self._gain = 0.0
        self._grip: Grip | None = None
        self._frame: Frame | None = None
        self.resting: Resting = "released"

    @property
    def gain(self) -> float:
        """How far the ramp is up, 0 to 1."""
        return self._gain

    @property
    def grip(self) -> Grip | None:
        """What the hand was asked last."""
        return self._grip

    def decide(self, asked: DriverInput, *, now_ns: int, tcp_quat: Quat) -> Twist | Hold:
        """Return the intent of one step.

        Args:
            asked: what the device said last.
            now_ns: the driver's time.
            tcp_quat: how the tool is turned now, base frame.
        """
        self._grip = asked.grip or self._grip
        self.resting = self._why_rest(asked, now_ns)
        if asked.frame is not self._frame:
            self._frame, self._gain = asked.frame, 0.0
        if self.resting:
            self._gain = 0.0
            return Hold(grip=self._grip)
        limits = self._limits
        self._gain = min(1.0, self._gain + limits.step_s / limits.ramp_s)
        share = self._gain * min(max(asked.speed_share, 0.0), 1.0)
        linear = _scaled(_within_one(asked.linear), share * limits.full_m_s)
        angular = _scaled(_within_one(asked.angular), share * limits.full_rad_s)
        if asked.frame is Frame.TOOL:
            linear, angular = rotated(linear, tcp_quat), rotated(angular, tcp_quat)
        return Twist(linear_m_s=linear, angular_rad_s=angular, grip=self._grip)

    def _why_rest(self, asked: DriverInput, now_ns: int) -> Resting:
        """Return why the arm must rest, empty if it need not."""
        if not all(map(math.isfinite, (*asked.linear, *asked.angular, asked.speed_share))):
            return "wrong input"
        if not -self._deadline_ns <= now_ns - asked.stamp_ns <= self._deadline_ns:
            return "silent"
        if asked.is_clutched:
            return "clutch"
        return "" if asked.is_held and any((*asked.linear, *asked.angular)) else "released"


def _within_one(share: Vec3) -> Vec3:
    """Return a direction, shortened to length 1 where it is longer."""
    length = math.hypot(*share)
    return share if length <= 1.0 else _scaled(share, 1.0 / length)


def _scaled(vector: Vec3, factor: float) -> Vec3:
    return vector[0] * factor, vector[1] * factor, vector[2] * factor
