"""What a push bent joints by, let go of smoothly: how far the arm still is from an upright tool's joints."""

from robot.messages import Vec6

__all__ = ["Lean"]

FADE_S = 0.4
"""It is gone after so long: 12 mrad at most at 0.5 rad/s²."""
LEAST_RAD = 1e-5
"""Less than this is a solver's last digits, and no push: taken back in a tick it is 2.5 rad/s²."""
NONE: Vec6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Lean:
    """An offset of joints that fades by a quintic, from rest to rest.

    In ticks as short as a real arm's joints cannot take it back at once, as they can in the twin's: what was held back
    of it came again with every tick, and the arm swung ever harder until no step was left that it might take.

    Args:
        tick_s: how long a tick is.
    """

    def __init__(self, *, tick_s: float) -> None:
        self._n, self._k, self._offset = max(1, round(FADE_S / tick_s)), 0, NONE

    @property
    def is_over(self) -> bool:
        """Whether nothing is left of it."""
        return self._offset is NONE

    def begin(self, at_rad: Vec6, upright_rad: Vec6 | None) -> None:
        """Begin anew from where joints are; without an upright tool's joints there is nothing to let go of."""
        self._k, self._offset = 0, NONE
        if upright_rad is None:
            return
        a, b = at_rad, upright_rad
        offset = a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5]
        if max(offset) > LEAST_RAD or min(offset) < -LEAST_RAD:
            self._offset = offset

    def step(self, upright_rad: Vec6) -> Vec6:
        """Return the joints of the next tick: an upright tool's and what is left of the offset."""
        self._k += 1
        s = self._k / self._n
        if s >= 1.0:
            self._offset = NONE
            return upright_rad
        left, q, o = 1.0 - s * s * s * (10.0 - 15.0 * s + 6.0 * s * s), upright_rad, self._offset
        return (
            q[0] + left * o[0], q[1] + left * o[1], q[2] + left * o[2],
            q[3] + left * o[3], q[4] + left * o[4], q[5] + left * o[5],
        )  # fmt: skip
