"""The last say before the arm: limits, checks, distances, stops, the gate that latches, and arming."""

from robot.safety.arming import Armable, Arming, Operator, TooManyLatchesError
from robot.safety.checks import Reason, Refusal
from robot.safety.clearance import Clearance
from robot.safety.collision_model import Hard
from robot.safety.gate import Gate
from robot.safety.limits import GateLimits, check_profile_fits
from robot.safety.stop_check import StopCheck
from robot.safety.stopping import Braking

__all__ = [
    "Armable",
    "Arming",
    "Braking",
    "Clearance",
    "Gate",
    "GateLimits",
    "Hard",
    "Operator",
    "Reason",
    "Refusal",
    "StopCheck",
    "TooManyLatchesError",
    "check_profile_fits",
]
