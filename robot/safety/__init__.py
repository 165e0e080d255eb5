"""The last say before the arm: limits, checks, the gate that latches, and arming."""

from robot.safety.arming import Armable, Arming, Operator, TooManyLatchesError
from robot.safety.checks import Reason, Refusal
from robot.safety.gate import Gate
from robot.safety.limits import GateLimits, check_profile_fits

__all__ = [
    "Armable",
    "Arming",
    "Gate",
    "GateLimits",
    "Operator",
    "Reason",
    "Refusal",
    "TooManyLatchesError",
    "check_profile_fits",
]
