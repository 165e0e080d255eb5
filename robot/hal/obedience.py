"""Whether what a controller steers for is what it was sent: a program that obeys nobody looks like an arm at rest.

Servoing smooths what it is sent, as a lag of the first order or near it. What comes of that lies between the least and
the greatest that was sent of late, whatever was sent. The arm's joints would not do: something may hold them up.
"""

from collections import deque
from collections.abc import Sequence

from robot.messages import Vec6

__all__ = ["LOOK_TICKS", "N_SAMPLES", "TOLERANCE_RAD", "Obedience"]

LOOK_TICKS = 25
"""Of 2 ms, between two looks."""
N_SAMPLES = 8
"""Looks that count as of late: 0.35 s, ten times the arm file's lookahead."""
TOLERANCE_RAD = 0.015
"""What servoing may overshoot, and commands between two looks lie farther out: 2.5 mrad at 8 rad/s²."""


class Obedience:
    """Holds targets against what was sent, at one look after the other. State: what was sent at the last of them."""

    def __init__(self) -> None:
        self._sent: deque[Vec6] = deque(maxlen=N_SAMPLES)

    def seed(self) -> None:
        """Begin anew: nothing was sent."""
        self._sent.clear()

    def check(self, sent_rad: Vec6, target_rad: Sequence[float]) -> str | None:
        """Return what is wrong, None for nothing; nothing is before as many looks as count.  (6,), (6,)"""
        self._sent.append(sent_rad)
        if len(self._sent) < N_SAMPLES:
            return None
        for joint, (target, ways) in enumerate(zip(target_rad, zip(*self._sent, strict=True), strict=True)):
            least, most = min(ways) - TOLERANCE_RAD, max(ways) + TOLERANCE_RAD
            if not least <= target <= most:
                return (
                    f"expected the controller to steer joint {joint} for what it is sent, {least:.3f} to {most:.3f} "
                    f"rad with tolerance, it steers for {target:.3f}: does its program still obey?"
                )
        return None
