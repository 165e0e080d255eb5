"""The force guard: a descent stops where the tool is held up, a slide where it is held back."""

import math

from config.arm import ArmConfig
from robot.messages import Vec3

__all__ = ["ContactGuard"]

PROBE_M = 0.001
"""How far a step may push on while the tool is held up, to find out whether it still is."""
RISEN_M = 0.001
SUNK_M = 0.002
SLID_M = 0.005
_TINY = 1e-9


class ContactGuard:
    """Decides from the measured force where the target may not go on.

    Held up stays true from the first push until the tool is lifted, slides away or sinks, so that a percept between
    two pushes does not read as free. Sideways a push counts when it lasts two ticks: the jaws' own forces on what they
    hold do not cancel at every instant.
    """

    def __init__(self, arm: ArmConfig) -> None:
        self._force_n = arm.motion.contact_force_n
        self._was_pushed_back = False
        self._held: Vec3 | None = None
        """Where the target was in the plane, and the tool in height, when the tool was held up."""

    @property
    def is_in_contact(self) -> bool:
        """Whether something holds the tool up."""
        return self._held is not None

    def reset(self) -> None:
        """Forget any contact."""
        self._held = None
        self._was_pushed_back = False

    def is_free(self, force_n: Vec3) -> bool:
        """Return whether nothing holds the tool and `reseat` need not be asked."""
        fx, fy, fz = force_n
        most = self._force_n
        return fz <= most and fx * fx + fy * fy <= most * most and self._held is None and not self._was_pushed_back

    def ease(self, at_m: Vec3, wanted_m: Vec3) -> tuple[Vec3, bool]:
        """Let a step push on only a little while the tool is held up.

        Args:
            at_m: The target before the step.
            wanted_m: The target that the step asks for.

        Returns:
            The target allowed, and whether it was changed.
        """
        if self._held is None:
            return wanted_m, False
        x, y, z = wanted_m
        held = self._held
        if z > at_m[2] + RISEN_M or math.hypot(x - held[0], y - held[1]) > SLID_M:
            self._held = None
            return wanted_m, False
        lowest = at_m[2] - PROBE_M
        if z < lowest - _TINY:
            return (x, y, lowest), True
        return wanted_m, False

    def is_led_up(self, force_n: Vec3, measured_m: Vec3, commanded_m: Vec3, target_m: Vec3) -> bool:
        """Return whether a tool is asked to rise from what presses on it, and need not fall back first.

        Sideways pushes took its command back to the measured tool in every tick, so that one which a button's cap held
        against a fence never rose from it, with 280 N on its fingers.

        Args:
            force_n: Force of the world on the tool.
            measured_m: Where the tool is.
            commanded_m: Where it was told to be by now; lower than it is it must fall back.
            target_m: Where it is to go.
        """
        is_risen = min(target_m[2] - RISEN_M, commanded_m[2] + RISEN_M) > measured_m[2]
        return is_risen and force_n[2] > self._force_n

    def reseat(self, force_n: Vec3, measured_m: Vec3, commanded_m: Vec3, target_m: Vec3) -> Vec3 | None:
        """Return where the target must go because of the force on the tool, or None to leave it.

        Args:
            force_n: Force of the world on the tool.
            measured_m: Where the tool is.
            commanded_m: Where it was told to be by now.
            target_m: Where it would go.
        """
        fx, fy, fz = force_n
        x, y, z = target_m
        held = self._held
        if held is not None and measured_m[2] < held[2] - SUNK_M:  # it brakes on what pushes it, or sank from there
            self._held = (held[0], held[1], measured_m[2]) if fz > self._force_n else None
        is_pushed_up = fz > self._force_n and min(z, commanded_m[2]) < measured_m[2] - _TINY
        if is_pushed_up:
            z = max(z, measured_m[2])  # a tool that was told to rise is not held down by what it still presses on
        is_pushed_back = math.hypot(fx, fy) > self._force_n
        if is_pushed_back and self._was_pushed_back and (x - measured_m[0]) * fx + (y - measured_m[1]) * fy < 0.0:
            x, y = measured_m[0], measured_m[1]
        self._was_pushed_back = is_pushed_back
        if is_pushed_up and self._held is None:
            self._held = (x, y, measured_m[2])
        return (x, y, z) if is_pushed_up or (x, y, z) != target_m else None
