"""Where a free tool is by now, told from what was commanded: no measurement says it in time.

A measurement is a few milliseconds old, more or less, and at half a metre a second each of them is half a millimetre.
What follows from it would bend a path by chance.
"""

from collections import deque

from config.arm import Servo
from robot.messages import Vec6
from robot.servo import lag_s

__all__ = ["Trail"]


class Trail:
    """The newest commands of one arm. `seed` forgets all before.

    Args:
        servo: How the arm follows its set-points.
        tick_s: How long each command holds.
        q_rad: Joints at which it rests.
        n_ahead: So many ticks later it is asked for, as far as that was commanded already.
    """

    def __init__(self, servo: Servo, *, tick_s: float, q_rad: Vec6, n_ahead: int = 0) -> None:
        lag = lag_s(lookahead_s=servo.lookahead_s, gain=servo.gain, dead_time_s=servo.dead_time_s)
        n_ticks = max(0.0, lag / tick_s - n_ahead)
        self._n_before = int(n_ticks)
        self._share = n_ticks - self._n_before
        self._commands: deque[Vec6] = deque(maxlen=self._n_before + 2)
        self.seed(q_rad)

    def seed(self, q_rad: Vec6) -> None:
        """The arm rests at these joints."""
        self._commands.extend([q_rad] * (self._n_before + 2))

    def add(self, q_rad: Vec6) -> None:
        """These joints are commanded for the tick that begins."""
        self._commands.append(q_rad)

    @property
    def q_rad(self) -> Vec6:
        """Joints of an arm that nothing holds up, at the end of the newest command's tick or so many later."""
        older, newer = self._commands[0], self._commands[1]
        a, b, c, d, e, f = (n + self._share * (o - n) for o, n in zip(older, newer, strict=True))
        return a, b, c, d, e, f
