"""Intents that lead the tool to and fro over the middle of the table, as long as somebody goes on asking."""

from robot.messages import Twist, Vec3

__all__ = ["SPEED_M_S", "Shuttle"]

SPEED_M_S = 0.35
REACH_M = 0.16
"""The tool goes to and fro between these, left and right of the middle."""


class Shuttle:
    """Remembers which way the tool goes, and where it was seen last."""

    def __init__(self) -> None:
        self._way, self._y_m = 1.0, REACH_M

    @property
    def intent(self) -> Twist:
        """On with it."""
        return Twist(linear_m_s=(0.0, self._way * SPEED_M_S, 0.0))

    @property
    def is_midway(self) -> bool:
        """Whether the tool was near the middle and on its way there: at full speed, and far from turning."""
        return abs(self._y_m) < REACH_M / 2 and self._y_m * self._way < 0.0

    def note(self, tcp_m: Vec3) -> None:
        """Turn where the tool has come to an end of its way."""
        self._y_m = tcp_m[1]
        if abs(self._y_m) > REACH_M and self._y_m * self._way > 0.0:
            self._way = -self._way
