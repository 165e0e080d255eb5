"""Sessions as data sets of others."""

from robot.recording.exporting.episodes import Course, Episode, Names, courses_of

__all__ = ["Course", "Episode", "Names", "courses_of"]
