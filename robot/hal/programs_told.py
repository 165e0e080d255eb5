"""Whose program runs, by what a controller tells of programs as they begin and end: their names. State.

Two programs never run at once: who starts one replaces the other, and each begin and end is told by name.
"""

from robot.hal.ur_primary import KeyMessage

__all__ = ["OURS", "STARTED", "STOPPED", "ProgramsTold"]

STARTED, STOPPED = "PROGRAM_XXX_STARTED", "PROGRAM_XXX_STOPPED"
"""Titles of the key messages that tell of a program's start and end; their text is its name."""
OURS = "rtde_control"
"""What the client calls the program that it uploads."""


class ProgramsTold:
    """Remembers who has started what.

    Attributes:
        n_due: Uploads of ours that were not told to have started.
        foreign: Name of the first program that somebody else started; None where nobody did.
        running: Name of the program that was started last and not told to have ended; None for none.
        is_ours: Whether that one is ours.
    """

    def __init__(self) -> None:
        self.n_due, self.is_ours = 0, False
        self.foreign: str | None = None
        self.running: str | None = None

    def expect(self) -> None:
        """Count one more upload of ours. What is started under its name without one is somebody's too."""
        self.n_due += 1

    def take(self, key: KeyMessage) -> None:
        """Take what was told; what is about no program is passed over."""
        if key.title == STARTED:
            self.is_ours = key.text == OURS and self.n_due > 0
            self.n_due -= self.is_ours
            self.running = key.text
            if not self.is_ours and self.foreign is None:
                self.foreign = key.text
        elif key.title == STOPPED and key.text == self.running:
            self.running, self.is_ours = None, False

    @property
    def may_be_ours(self) -> bool:
        """Whether a program of ours runs, or is still to begin, as far as was told."""
        return self.is_ours or self.n_due > 0
