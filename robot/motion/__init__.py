"""Intents to joint targets, and the reflexes of the hand."""

from robot.motion.approach import Approach
from robot.motion.mover import Mover
from robot.motion.reflexes import HandReflexes

__all__ = ["Approach", "HandReflexes", "Mover"]
