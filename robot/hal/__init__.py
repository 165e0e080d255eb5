"""Doors to a world and what stands behind them. Plants are named by import strings in rig files."""

from robot.hal.protocols import Arm, Camera, Clock, Frame, Plant, Resetter, SceneTruth

__all__ = ["Arm", "Camera", "Clock", "Frame", "Plant", "Resetter", "SceneTruth"]
