"""The one set-point that motions write and the drive reads, and the pace at which their time passes."""

import numpy as np

from sim_twin.controller.motion.poses import Array

__all__ = ["SLICE_S", "USED_SPEED", "Pace", "SetPoint"]

SLICE_S = 0.002
"""UR's e-Series run at 500 slices a second."""
USED_SPEED = 0.97
"""Share of the greatest speeds that motions use: the servos' overshoot fits into the rest."""
PACE_PER_S = 4.0
"""How fast the pace changes: a pause comes to rest within a quarter of a second."""


class SetPoint:
    """Where the joints are asked to be in this slice.

    Attributes:
        q_target: Joint angles, radians.
        qd_target: Their speed, radians a second: the change since the slice before.
        qdd_target: Its change, radians a second squared.
    """

    def __init__(self, q_rad: Array) -> None:
        self.place(q_rad)

    def place(self, q_rad: Array, qd_rad_s: Array | None = None) -> None:
        """Put the set-point somewhere, at rest or at a speed; what it did before is forgotten.  (6,), (6,)"""
        self.q_target = np.array(q_rad, dtype=np.float64)
        self.qd_target = np.zeros(6) if qd_rad_s is None else np.array(qd_rad_s, dtype=np.float64)
        self.qdd_target = np.zeros(6)
        self._before = (self.q_target, self.qd_target)

    def move(self, q_rad: Array) -> None:
        """Set the next slice's joints.  (6,)"""
        self._before = (self.q_target, self.qd_target)
        speed = (q_rad - self.q_target) / SLICE_S
        self.qdd_target = (speed - self.qd_target) / SLICE_S
        self.qd_target, self.q_target = speed, q_rad

    def undo(self) -> None:
        """Take the last move back: it was refused."""
        self.q_target, self.qd_target = self._before
        self.qdd_target = np.zeros(6)

    @property
    def fastest_rad_s(self) -> float:
        """Speed of the fastest joint."""
        return float(np.abs(self.qd_target).max())


class Pace:
    """How fast the time of motions passes: the speed slider, and a pause that is reached by slowing down.

    Attributes:
        scale: Share of full speed in this slice.
        is_paused: Asked to stand still on the path.
    """

    def __init__(self) -> None:
        self.scale = 1.0
        self.is_paused = False
        self._slider = 1.0

    @property
    def slider(self) -> float:
        """The speed slider's share."""
        return self._slider

    def set_slider(self, share: float) -> None:
        """Move the speed slider.

        Raises:
            ValueError: not between 0 and 1.
        """
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"speed slider: expected 0 to 1, got {share}; give a share of full speed")
        self._slider = share

    def step(self) -> None:
        """Let one slice pass."""
        goal = 0.0 if self.is_paused else self._slider
        change = PACE_PER_S * SLICE_S
        self.scale += min(max(goal - self.scale, -change), change)
