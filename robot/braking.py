"""How hard an arm brakes that is stopped: what motion counts on ahead of limits, and the gate of every stop."""

import msgspec

__all__ = ["Braking"]


class Braking(msgspec.Struct, frozen=True, kw_only=True):
    """How hard a stop brakes the fastest joint."""

    deceleration_rad_s2: float = 16.0
    """A CB3 UR5 with all its speed and load stops its base in 0.31 rad, 244 ms, which is 10; of a UR5e only graphs are
    published. The twin's stop has 16."""
    least_share: float = 0.5
    """Share of it that a stop has at the worst: bodies are kept apart by that."""

    @property
    def least_rad_s2(self) -> float:
        """Deceleration at the worst."""
        return self.deceleration_rad_s2 * self.least_share
