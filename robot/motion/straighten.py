"""What a tool is tilted by when it is taken up as upright is taken away smoothly, not in one tick. State of one arm.

A hundredth of a radian that is set right in a tick of 10 ms is a jolt of 100 rad/s2.
"""

import math

from robot.messages import Vec6

__all__ = ["Straightening"]

SPAN_S = 0.15
"""A hundredth of a radian then takes 2.6 rad/s2 and 180 rad/s3 at most."""
NONE: Vec6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Straightening:
    """Joints' differences from those of an upright tool, faded out along 1 - (10 s^3 - 15 s^4 + 6 s^5).

    Args:
        tick_s: how long a tick is.
    """

    def __init__(self, *, tick_s: float) -> None:
        self._n_ticks = math.ceil(SPAN_S / tick_s)
        self._n_done = self._n_ticks
        self._off_rad = NONE

    @property
    def is_done(self) -> bool:
        """Whether nothing is left."""
        return self._n_done >= self._n_ticks

    def begin(self, q_rad: Vec6, upright_rad: Vec6) -> None:
        """Begin at joints in place of those that an upright tool would have."""
        a, b, c, d, e, f = [u - v for u, v in zip(q_rad, upright_rad, strict=True)]
        self._off_rad, self._n_done = (a, b, c, d, e, f), 0

    def end(self) -> None:
        """Leave out what is left."""
        self._n_done = self._n_ticks

    def add_to(self, upright_rad: Vec6) -> Vec6:
        """Return the joints for the next tick in place of those of an upright tool."""
        self._n_done += 1
        if self.is_done:
            return upright_rad
        s = self._n_done / self._n_ticks
        left = 1.0 - s * s * s * (10.0 - s * (15.0 - 6.0 * s))
        a, b, c, d, e, f = [q + left * off for q, off in zip(upright_rad, self._off_rad, strict=True)]
        return a, b, c, d, e, f
