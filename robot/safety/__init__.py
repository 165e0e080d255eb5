"""The last say before the arm: limits, checks, distances, stops, the gate that latches, and arming."""

from robot.safety.arming import Armable, Arming, Buttoned, Grant, Operator, TooManyLatchesError
from robot.safety.arming_button import ArmingButton, PressWatch
from robot.safety.blocks import Block
from robot.safety.challenge import Answer, AnsweredBy, Challenges, draw_code
from robot.safety.checks import Reason, Refusal
from robot.safety.clearance import Clearance
from robot.safety.collision_model import Hard
from robot.safety.cross_check import CrossCheck
from robot.safety.gate import Gate
from robot.safety.lease import Lease, LeaseBook
from robot.safety.limits import GateLimits, check_profile_fits
from robot.safety.obstacles import Obstacles
from robot.safety.states import TABLE, Event, next_mode
from robot.safety.stop_check import StopCheck
from robot.safety.stopping import Braking
from robot.safety.tenure import Tenure

__all__ = [
    "TABLE",
    "Answer",
    "AnsweredBy",
    "Armable",
    "Arming",
    "ArmingButton",
    "Block",
    "Braking",
    "Buttoned",
    "Challenges",
    "Clearance",
    "CrossCheck",
    "Event",
    "Gate",
    "GateLimits",
    "Grant",
    "Hard",
    "Lease",
    "LeaseBook",
    "Obstacles",
    "Operator",
    "PressWatch",
    "Reason",
    "Refusal",
    "StopCheck",
    "Tenure",
    "TooManyLatchesError",
    "check_profile_fits",
    "draw_code",
    "next_mode",
]
