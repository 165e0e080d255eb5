"""Who drives by hand, and what is put before a station to see that its limits hold whoever drives."""

from robot.teleop.asks import Arena, Ask, Look, Seen, Send, Silence, Write
from robot.teleop.battery import Battery, Place, Search

__all__ = ["Arena", "Ask", "Battery", "Look", "Place", "Search", "Seen", "Send", "Silence", "Write"]
