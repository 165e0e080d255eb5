"""The last say before the arm: limits, checks, the gate that latches, and arming."""

from robot.safety.arming import Armable, Arming, Grant, Operator, TooManyLatchesError
from robot.safety.challenge import Answer, AnsweredBy, Challenges, draw_code
from robot.safety.checks import Reason, Refusal
from robot.safety.gate import Gate
from robot.safety.lease import Lease, LeaseBook
from robot.safety.limits import GateLimits
from robot.safety.states import TABLE, Event, next_mode
from robot.safety.tenure import Tenure

__all__ = [
    "TABLE",
    "Answer",
    "AnsweredBy",
    "Armable",
    "Arming",
    "Challenges",
    "Event",
    "Gate",
    "GateLimits",
    "Grant",
    "Lease",
    "LeaseBook",
    "Operator",
    "Reason",
    "Refusal",
    "Tenure",
    "TooManyLatchesError",
    "draw_code",
    "next_mode",
]
