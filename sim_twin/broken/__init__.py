"""What our backend does when the controller in front of it is broken on purpose, judged on the twin's own joints."""

from sim_twin.broken.course import Course
from sim_twin.broken.judge import Judged, Motion
from sim_twin.broken.outcome import Outcome
from sim_twin.broken.rider import Raised, Rider
from sim_twin.broken.trials import TRIALS, Trial
from sim_twin.broken.tries import CutShortError, DisturbedError

__all__ = [
    "TRIALS", "Course", "CutShortError", "DisturbedError", "Judged", "Motion", "Outcome", "Raised", "Rider", "Trial",
]  # fmt: skip
