"""Intents to joint targets, and what the hand does meanwhile."""

from robot.motion.approach import Approach
from robot.motion.asked_hand import AskedHand
from robot.motion.mover import Mover
from robot.motion.reflexes import HandReflexes

__all__ = ["Approach", "AskedHand", "Hand", "HandReflexes", "Mover"]

Hand = HandReflexes | AskedHand
"""What decides what the fingers do: reflexes beside what is asked, or what is asked alone."""
