"""What of a reading is the plant's doing and no controller's, limit by limit, with its reason.

A limit is kept by commands; it is judged on the physics. Between the two stand a servo and, on a perturbed plant, an
error that nobody was told of. What these can add is bounded here from the plant's own model and never fitted to what a
stack happened to do:

* rounding of the physics and of one tick: 0.1 % of a limit. Set-points that reach the drives are judged with nothing
  else: for what was asked of the plant no plant is an excuse. A chord of one tick is never longer than the path;
* the servo: joints follow set-points as a mass on a spring with damping below critical: 0.43 of it where the shoulder
  holds the stretched arm (6 kNm/rad, 130 Nms/rad, 4 kgm²). A step of speed overshoots by exp(-π ζ / √(1 - ζ²)), 22 %,
  and that is allowed to joints and points. Set-points that swing at the servo's own rate could add up to more, which
  counts as broken; a real arm's servo is stiffer and overshoots less;
* links and tool longer by e each: a point of the arm is off by at most three times e;
* a payload that nobody compensates: joints droop by its torque over their stiffness;
* fingers meet end stops that a blow of 700 N, rising in 20 ms, presses 0.7 mm deep in one step of the physics;
* postures that set-points ask for bow by a millimetre between two targets of a tool that goes straight.
"""

import msgspec

from config.limits import Profile
from config.perturbation import Perturbation
from sim_twin.scales import keep_out_scale_m, least_half_m, plane_scale_m

__all__ = ["Allowances", "allowances_for"]

ROUNDING = 1e-3
OVERSHOOT = 0.22
"""Of speeds and of accelerations over one tick, by the servo."""
RAMP = 0.02
"""Of the fingers' speed over a tenth of a second."""
GIVE_RAD = 0.003
"""A joint that brakes at its end swings past by so much."""
BOW_M = 0.002
"""The tool brakes at 3 m/s² on a servo of 38 rad/s and up: it swings past by at most 3 / 38² m."""
ASKED_M = 0.0012
"""Set-points of a tool that goes straight bow by a millimetre between its targets; distances are told to 0.1 mm and
joints to what they are asked with."""
END_STOP_M = 0.001
N_LENGTHENED = 3
DROOP_M_PER_KG = 0.0025
"""Gravity on 0.85 m of arm over the stiffness of shoulder and elbow (6 kNm/rad) and wrist (1.2 kNm/rad)."""
DROOP_RAD_PER_KG = 0.0015


class Allowances(msgspec.Struct, frozen=True, kw_only=True):
    """Shares of a limit that the truth may be beyond it before a reading counts as broken."""

    by_limit: dict[str, float] = msgspec.field(default_factory=dict)
    otherwise: float = ROUNDING

    def of(self, limit: str) -> float:
        """Return a limit's allowance; that of `box` holds for every `box:NAME` that has none of its own."""
        return self.by_limit.get(limit, self.by_limit.get(limit.split(":", 1)[0], self.otherwise))


def allowances_for(profile: Profile, by: Perturbation) -> Allowances:
    """Return what a plant so perturbed may add to the limits of a profile."""
    space, load = profile.workspace, abs(by.payload_kg)
    off_m = BOW_M + N_LENGTHENED * by.kinematics_m + DROOP_M_PER_KG * load
    droop = DROOP_RAD_PER_KG * load
    shares = {"joint_speed": OVERSHOOT, "tcp_speed": OVERSHOOT, "flange_speed": OVERSHOOT, "elbow_speed": OVERSHOOT}
    shares |= {f"box:{b.name}": off_m / least_half_m(b.low_m, b.high_m) for b in space.boxes}
    shares |= {f"plane:{p.name}": off_m / plane_scale_m(p) for p in space.planes}
    shares |= {f"keep_out:{k.name}": off_m / keep_out_scale_m(k) for k in space.keep_outs}
    for name, least_m in (
        ("self_clearance", profile.clearances.self_m),
        ("scene_clearance", profile.clearances.scene_m),
    ):
        shares[name] = off_m / max(least_m, off_m)
        asked_m = ASKED_M + N_LENGTHENED * by.kinematics_m
        shares[f"command_{name}"] = asked_m / max(least_m, asked_m)
    shares["meeting_speed"] = OVERSHOOT
    shares["joint_acceleration"] = OVERSHOOT
    narrowest = min(j.range_rad[1] - j.range_rad[0] for j in profile.joints) / 2.0
    shares["joint_range"] = (GIVE_RAD + droop) / narrowest
    shares["tool_cone"] = (BOW_M + 3.0 * droop) / space.tool_cone_rad
    low, high = profile.grip.opening_m
    shares["grip_speed"] = RAMP
    shares["grip_opening"] = END_STOP_M / ((high - low) / 2.0)
    return Allowances(by_limit=shares)
