"""Measurements to percept."""

from perception.percept import Perception

__all__ = ["Perception"]
