"""Who drives by hand, and what is put before a station to see that its limits hold whoever drives."""

from robot.teleop.asks import Arena, Ask, Look, Seen, Send, Silence, Write
from robot.teleop.battery import Battery, Place, Search
from robot.teleop.device import Device, DriverInput, Frame
from robot.teleop.driver import DrivenStation, Driver
from robot.teleop.jog import Jog

__all__ = [
    "Arena",
    "Ask",
    "Battery",
    "Device",
    "DrivenStation",
    "Driver",
    "DriverInput",
    "Frame",
    "Jog",
    "Look",
    "Place",
    "Search",
    "Seen",
    "Send",
    "Silence",
    "Write",
]
