"""speedj, speedl, stopj, stopl: speeds that are approached at an acceleration and kept."""

from collections.abc import Callable, Sequence

import numpy as np

from sim_twin.controller.motion.core import Motion, MotionCore, Tail
from sim_twin.controller.motion.kinematics import joint_speeds_of
from sim_twin.controller.motion.poses import Array, vec6
from sim_twin.controller.motion.setpoint import SLICE_S

__all__ = ["Speeds"]

Numbers = Sequence[float] | Array
REACHED = 1e-9
PAUSE_RAD_S2, PAUSE_M_S2 = 10.0, 4.0
"""A pause slows down at least so hard, however gentle the acceleration that the program asked for."""


class Speeds:
    """Generators that approach a speed; resume one once a slice.

    Without a time a speed returns when it is reached and is kept until another motion takes over; with a time it
    returns after it, and the arm slows down at the same acceleration unless another motion takes over in that slice.

    Args:
        core: What motions share.
    """

    def __init__(self, core: MotionCore) -> None:
        self._core = core

    def speedj(self, qd: Numbers, a: float = 1.4, t: float = 0.0) -> Motion:
        """Approach joint speeds, the joint with most to change at a; all in proportion, as fast as the arm may."""
        goal = vec6(qd, "joint speeds")
        _check_positive(a)
        core = self._core
        goal = goal * min(1.0, float(np.min(core.speed_rad_s / np.maximum(np.abs(goal), core.speed_rad_s))))
        return self._approach(self._joints, goal, min(a, float(core.acceleration_rad_s2.min())), t)

    def speedl(self, xd: Numbers, a: float = 1.2, t: float = 0.0) -> Motion:
        """Approach a tool speed (v, w) in base axes, its translation at a.

        Raises:
            SingularError: while it is resumed, where the arm cannot go on in every direction.
        """
        goal = vec6(xd, "tool speed")
        _check_positive(a)
        return self._approach(self._tool, goal, a, t)

    def stopj(self, a: float = 2.0) -> Motion:
        """Slow all joints down in proportion, the fastest at a, and return at rest."""
        _check_positive(a)
        return self._stop(self._joints, a)

    def stopl(self, a: float = 2.0) -> Motion:
        """Slow the tool down along its direction at a, and return at rest."""
        _check_positive(a)
        return self._stop(self._tool, a)

    def _approach(self, step: Callable[[Array, Array, float], Array], goal: Array, a: float, t: float) -> Motion:
        core = self._core
        core.begin_free()
        elapsed_s = 0.0
        keeping = self._keep(step, goal, a)
        while True:
            next(keeping)
            yield
            elapsed_s += SLICE_S
            if t > 0.0 and elapsed_s >= t - REACHED:
                core.tail = Tail(self._stop(step, a, is_tail=True))
                return
            if t <= 0.0 and self._is_reached:
                core.tail = Tail(keeping)
                return

    def _keep(self, step: Callable[[Array, Array, float], Array], goal: Array, a: float) -> Motion:
        core = self._core
        while True:
            speed = step(core.nominal_speed_rad_s, goal * core.pace.scale, a)
            core.put(core.nominal_rad + speed * SLICE_S)
            yield

    def _stop(self, step: Callable[[Array, Array, float], Array], a: float, *, is_tail: bool = False) -> Motion:
        core = self._core
        if not is_tail:
            core.begin_free()
        goal = np.zeros(6)
        while True:
            speed = step(core.nominal_speed_rad_s, goal, a)
            core.put(core.nominal_rad + speed * SLICE_S)
            yield
            if not speed.any():
                return

    def _joints(self, speed: Array, goal: Array, a: float) -> Array:
        a = max(a, PAUSE_RAD_S2) if self._core.pace.is_paused else a
        change = goal - speed
        largest = float(np.abs(change).max())
        self._is_reached = largest <= a * SLICE_S
        return goal if self._is_reached else speed + change * (a * SLICE_S / largest)

    def _tool(self, speed: Array, goal: Array, a: float) -> Array:
        core = self._core
        a = max(a, PAUSE_M_S2) if core.pace.is_paused else a
        J = core.kinematics.jacobian(core.nominal_rad, core.T_ft)
        twist = J @ speed
        change = goal - twist
        # A turn has no acceleration of its own in UR's call: the change is one, and its greater half sets the time.
        largest = max(float(np.linalg.norm(change[:3])), float(np.linalg.norm(change[3:])))
        self._is_reached = largest <= a * SLICE_S
        if self._is_reached and not goal.any():
            return np.zeros(6)
        return joint_speeds_of(J, goal if self._is_reached else twist + change * (a * SLICE_S / largest))

    _is_reached = False


def _check_positive(a: float) -> None:
    if not a > 0.0:
        raise ValueError(f"acceleration: expected above 0, got {a}; give m/s² or rad/s²")
