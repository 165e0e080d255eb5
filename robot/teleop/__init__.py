"""A person at the stick: devices become intents, and intents go the way of all others, through motion and gate."""

from robot.teleop.device import Device, DriverInput, Frame
from robot.teleop.driver import DrivenStation, Driver
from robot.teleop.jog import Jog

__all__ = ["Device", "DrivenStation", "Driver", "DriverInput", "Frame", "Jog"]
