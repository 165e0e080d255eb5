"""What is carried from one picture to the next: where things are, which lamps are lit, what the hand holds."""

from perception.tracking.course import ArmCourse
from perception.tracking.tracks import TableTracks, Tracked

__all__ = ["ArmCourse", "TableTracks", "Tracked"]
