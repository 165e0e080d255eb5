"""The newest commands of one arm and where each brings its parts: memory, laid out for what is compiled.

A command is one row of numbers, two lines of a processor's cache: at ticks of 2 ms what is spread over many small
objects has to be fetched from memory anew each time.
"""

import numpy as np

from robot.compiled import Table, compiled
from robot.messages import Vec3, Vec6
from robot.motion.holding import Place, Points

__all__ = ["Commands", "joints_of", "place_of", "put_command"]

N_FIELDS = 16
"""Six joints, tool centre point, flange and elbow, and the cosine of the tilt."""


@compiled
def joints_of(rows: Table, k: int) -> Vec6:
    """Return the joints of a command.  (n, 16), () -> (6,)"""
    return rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4], rows[k, 5]


@compiled
def place_of(rows: Table, k: int) -> Place:
    """Return where a command brings the parts.  (n, 16), () -> (10,)"""
    tcp, flange = (rows[k, 6], rows[k, 7], rows[k, 8]), (rows[k, 9], rows[k, 10], rows[k, 11])
    return (tcp, flange, (rows[k, 12], rows[k, 13], rows[k, 14])), rows[k, 15]


@compiled
def put_command(rows: Table, k: int, q: Vec6, place: Place) -> bool:
    """Write a command down as the k-th row. Always true."""
    points, down = place
    for i in range(6):
        rows[k, i] = q[i]
    for part in range(3):
        for axis in range(3):
            rows[k, 6 + 3 * part + axis] = points[part][axis]
    rows[k, 15] = down
    return True


class Commands:
    """A ring of the newest commands.

    Args:
        n: how many are remembered.

    Attributes:
        rows: (n, 16) joints, points and tilt of each.
        newest: Which row is the newest; the one after it is the oldest.
    """

    def __init__(self, n: int) -> None:
        self.rows: Table = np.zeros((n, N_FIELDS))
        self.newest, self._n = 0, n

    def seed(self, q_rad: Vec6, place: Place) -> None:
        """The arm rests there, and has for as long as is remembered."""
        for k in range(self._n):
            put_command(self.rows, k, q_rad, place)

    def add(self, q_rad: Vec6, place: Place) -> None:
        """Take note of one command more."""
        self.step()
        put_command(self.rows, self.newest, q_rad, place)

    def step(self) -> None:
        """The row after the newest is the newest now: what is compiled has written it."""
        self.newest = (self.newest + 1) % self._n

    @property
    def place(self) -> Place:
        """Where the newest brings the parts."""
        return place_of(self.rows, self.newest)

    @property
    def tcp_m(self) -> Vec3:
        """Where it brings the tool centre point."""
        return self.place[0][0]

    @property
    def points_before(self) -> Points:
        """Where the one before it brought them."""
        return place_of(self.rows, (self.newest - 1) % self._n)[0]

    @property
    def past(self) -> tuple[Points, Points]:
        """Where the two oldest did."""
        rows, k, n = self.rows, self.newest, self._n
        return place_of(rows, (k + 1) % n)[0], place_of(rows, (k + 2) % n)[0]
