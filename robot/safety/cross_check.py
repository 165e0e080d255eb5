"""What the controller says of its own tool against what our model says: two measurements of one motion, compared.

The controller works its tool's speed out with its own kinematics and tool, and its force with the payload that was set.
Ours come of the joints. Where they differ for longer than two readings can lie apart, one of the models is wrong, and
with it every limit that stands on ours.
"""

import math

from robot.chain import ToolChain, chain_tcp
from robot.compiled import Table, compiled
from robot.geometry import stepped
from robot.messages import ArmState, Vec3, Vec6
from robot.safety.checks import Reason, Refusal

__all__ = [
    "FREE_N",
    "LASTING_NS",
    "SHARE",
    "SPEED_M_S",
    "CrossCheck",
    "check_free",
    "check_tool_speed",
    "speed_of_tool",
    "tool_speed",
]

SPEED_M_S, SHARE = 0.03, 0.05
"""How far the two speeds may be apart: a constant part and a share of ours. Links 2 mm longer than in the file differ
by half the first; so do readings, 3 ms apart, of a tool that brakes at 5 m/s²."""
LASTING_NS = 50_000_000
"""For how long they may be farther apart. In a blow the tool's speed changes at once, and the readings are not of one
instant; a wrong model goes on being wrong."""
FREE_N = 20.0
"""Most force on a tool before anything has moved: that of two kilograms, more than sensor, offset and a thing in the
hand make together."""
STEP_S = 1e-3
"""The joints are taken ahead and back by so much, to tell our speed from two places: its error is of third order."""


class CrossCheck:
    """Holds the two together for one arm. State: since when they differ, and whether anything was asked yet.

    Args:
        chain: our model of the tool's place.
    """

    def __init__(self, chain: ToolChain) -> None:
        self._chain = chain
        self.seed()

    def seed(self) -> None:
        """Begin anew: nothing has moved since."""
        self._differs_since_ns: int | None = None
        self._is_first = True

    @property
    def is_first(self) -> bool:
        """Whether nothing was asked yet."""
        return self._is_first

    def agree(self) -> None:
        """Take note that the two belong together now, as somebody else has found out."""
        self._differs_since_ns = None

    def check(self, state: ArmState) -> Refusal | None:
        """Refuse a measurement whose parts cannot belong to the arm and the tool that we know."""
        is_first, self._is_first = self._is_first, False
        if is_first:
            refusal = check_free(math.hypot(*state.tcp_force_n))
            if refusal is not None:
                return refusal
        ours = tool_speed(self._chain, state)
        refusal = check_tool_speed(ours, state.tcp_speed_m_s)
        if refusal is None:
            self._differs_since_ns = None
            return None
        if not math.isfinite(refusal.amount):
            return refusal
        if self._differs_since_ns is None:
            self._differs_since_ns = state.stamp_ns
        return refusal if state.stamp_ns - self._differs_since_ns >= LASTING_NS else None


@compiled
def speed_of_tool(q_rad: Vec6, qd_rad_s: Vec6, rows: Table, tcp_m: Vec3) -> Vec3:
    """Return what `tool_speed` does, of joints and their speeds."""
    x1, y1, z1 = chain_tcp(stepped(q_rad, qd_rad_s, STEP_S), rows, tcp_m)
    x0, y0, z0 = chain_tcp(stepped(q_rad, qd_rad_s, -STEP_S), rows, tcp_m)
    return (x1 - x0) / (2.0 * STEP_S), (y1 - y0) / (2.0 * STEP_S), (z1 - z0) / (2.0 * STEP_S)


def tool_speed(chain: ToolChain, state: ArmState) -> Vec3:
    """Return the tool centre point's velocity by our model from the measured joints, base frame, m/s."""
    return speed_of_tool(state.q_rad, state.qd_rad_s, chain.rows, chain.tcp_m)


def check_tool_speed(ours_m_s: Vec3, reported_m_s: Vec3) -> Refusal | None:
    """Refuse a reported velocity of the tool that is not ours, within the constant part and the share."""
    gap_m_s = math.dist(ours_m_s, reported_m_s)
    most_m_s = SPEED_M_S + SHARE * math.hypot(*ours_m_s)
    if gap_m_s <= most_m_s:
        return None
    detail = (
        f"expected the controller's tool speed within {most_m_s:.3g} m/s of ours, came {gap_m_s:.3g}: ours "
        f"{_round(ours_m_s)}, its own {_round(reported_m_s)} m/s; are its tool centre point and calibration the file's?"
    )
    return Refusal(Reason.KINEMATICS, detail, gap_m_s - most_m_s)


def check_free(force_n: float) -> Refusal | None:
    """Refuse to begin with a force on the tool."""
    if force_n <= FREE_N:
        return None
    detail = (
        f"expected at most {FREE_N:g} N on a tool that has not moved yet, came {force_n:.3g}: is the payload that of "
        "the hand, was the sensor zeroed under load, does something push?"
    )
    return Refusal(Reason.PAYLOAD, detail, force_n - FREE_N)


def _round(velocity: Vec3) -> tuple[float, ...]:
    return tuple(round(v, 3) for v in velocity)
