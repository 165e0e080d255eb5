"""Whether a camera's frames are ones to go by: how many were lost, and whether they are all the same one. State."""

from robot.frames import Frame

__all__ = ["FrameWatch"]

FROZEN_AFTER = 3
"""So many pictures running that do not differ in one pixel: a sensor's noise alone makes two differ."""


class FrameWatch:
    """Counts lost frames by their numbers, and notices a picture that stands still.

    Attributes:
        n_lost: Frames that the camera took and that never came.
    """

    def __init__(self) -> None:
        self.n_lost = 0
        self._last: Frame | None = None
        self._n_same = 0

    @property
    def is_frozen(self) -> bool:
        """Whether the newest frames are one and the same picture."""
        return self._n_same + 1 >= FROZEN_AFTER

    def note(self, frame: Frame) -> None:
        """Take in the next frame that came."""
        if self._last is not None:
            self.n_lost += max(0, frame.sequence - self._last.sequence - 1)
            self._n_same = self._n_same + 1 if frame.pixels == self._last.pixels else 0
        self._last = frame
