"""What viewers draw of an arm and a table that are heard of over a bus. State."""

from robot.messages import ArmState, Percept
from robot.recording.picture import Picture
from robot.recording.taps import Writes
from robot.recording.topics import SCENE, TF

__all__ = ["Shown"]

EVERY_NS = 40_000_000
"""Viewers need no more."""


class Shown:
    """Writes frames and shapes as percepts come.

    Args:
        writes: takes them.
        picture: draws; one that has drawn nothing yet.
    """

    def __init__(self, writes: Writes, picture: Picture) -> None:
        self._writer, self._picture = writes, picture
        self._due_ns = 0

    def perceived(self, percept: Percept, state: ArmState | None, *, log_ns: int) -> None:
        """Write where links and things are now, if it is time for that, and what looks another way.

        Args:
            percept: the newest.
            state: the newest measurement; None where there is none.
            log_ns: the session's time.
        """
        if log_ns < self._due_ns:
            return
        self._due_ns = log_ns + EVERY_NS
        self._writer.write(TF, self._picture.frames(state, percept), log_ns=log_ns, stamp_ns=percept.stamp_ns)
        scene = self._picture.scene(percept)
        if scene is not None:
            self._writer.write(SCENE, scene, log_ns=log_ns, stamp_ns=percept.stamp_ns)
