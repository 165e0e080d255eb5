"""What one calibrated picture shows of a scenario's things: where they stand, lamps, lids."""

from perception.detection.colour_file import ColourFile, load_colours
from perception.detection.detector import Detector
from perception.detection.learning_colours import learn_colours
from perception.detection.seen import Detections, LampSeen, LidSeen, ThingSeen

__all__ = [
    "ColourFile", "Detections", "Detector", "LampSeen", "LidSeen", "ThingSeen", "learn_colours", "load_colours",
]  # fmt: skip
