"""Processes that hold something of a rig and serve it over the bus, and what others hold of them."""

from robot.node.asking import NodeAsker
from robot.node.pulse import HealthTeller, Pulse
from robot.node.remote_station import RemoteStation
from robot.node.robot_node import RobotNode
from robot.node.stop_caller import StopCaller

__all__ = ["HealthTeller", "NodeAsker", "Pulse", "RemoteStation", "RobotNode", "StopCaller"]
