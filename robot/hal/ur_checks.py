"""Is this the arm of the file? Calibrated kinematics, limits and pose, compared. Pure."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from config.arm import ArmConfig
from config.limits import ArmPart
from config.posture import part_points
from robot.errors import RobotConfigError
from robot.geometry import quat_of_rotation_vector, vec6
from robot.hal.ur_primary import ArmFacts
from robot.messages import Vec6

__all__ = ["check_facts", "check_pose", "check_serial", "flange_pose", "tool_off_m"]

CALIBRATION_M, CALIBRATION_RAD = 0.01, 0.05
"""Farther than this from nominal is no calibration of this model. A UR5e's own lie within some millimetres and mrad."""
OFFSETS = (slice(0, 1), slice(1, 4), slice(4, 5), slice(5, 6))
"""Link offsets by what is compared: d of the three joints whose axes are parallel may be shifted against one another as
far as a calibration likes, so that only their sum tells the model."""
TOOL_M, AROUND_RAD = 0.006, 0.5
"""How far an arm's own kinematics may bring the tool from where the file's do, which limits, fences and gate go by (a
factory's calibration takes 1 to 2 mm, `teleop check` tries 6), and how far joints are turned from home to see it."""
POSE_M, POSE_RAD = 1e-4, 1e-3
LIMIT_RAD = 1e-3


def check_serial(found: str, expected: str, address: str) -> None:
    """Refuse an arm with another serial number than the rig names.

    Raises:
        RobotConfigError: both numbers, and where.
    """
    if found != expected:
        raise RobotConfigError(
            f"expected the arm with serial {expected}, as the rig names it, found {found} at {address}: is the address "
            "another arm's?"
        )


def check_facts(facts: ArmFacts, arm: ArmConfig) -> None:
    """Refuse an arm of another model, or one whose limits are wider in our file than in its own installation.

    Raises:
        RobotConfigError: what was expected, what the arm says, and where.
    """
    for i, joint in enumerate(arm.joints):
        for name, ours, its, within in (
            ("a", joint.a_m, facts.a_m[i], CALIBRATION_M),
            ("alpha", joint.alpha_rad, facts.alpha_rad[i], CALIBRATION_RAD),
        ):
            if not abs(ours - its) <= within:
                raise RobotConfigError(
                    f"joint {joint.name}: expected {name} {ours:g} as in the arm's file, the arm says {its:g}: "
                    "is this another model?"
                )
        low, high = joint.range_rad
        its_low, its_high = facts.q_min_rad[i], facts.q_max_rad[i]
        if not (low >= its_low - LIMIT_RAD and high <= its_high + LIMIT_RAD):
            raise RobotConfigError(
                f"joint {joint.name}: expected a range within the arm's own {its_low:.3f} .. {its_high:.3f} rad, the "
                f"file gives {low:.3f} .. {high:.3f}: narrow it there"
            )
        if not joint.speed_rad_s <= facts.qd_max_rad_s[i] + LIMIT_RAD:
            raise RobotConfigError(
                f"joint {joint.name}: expected a speed of at most the arm's own {facts.qd_max_rad_s[i]:.3f} rad/s, the "
                f"file gives {joint.speed_rad_s:.3f}: lower it there"
            )
    ours_m = [joint.d_m for joint in arm.joints]
    for part in OFFSETS:
        ours, its = sum(ours_m[part]), sum(facts.d_m[part])
        if not abs(ours - its) <= CALIBRATION_M:
            name = " + ".join(f"d{i + 1}" for i in range(part.start, part.stop))
            raise RobotConfigError(
                f"expected {name} of {ours:g} m as in the arm's file, the arm says {its:g}: is this another model?"
            )
    away_m = max(tool_off_m(facts, arm, q_rad) for q_rad in _postures(facts, arm))
    if not away_m <= TOOL_M:
        raise RobotConfigError(
            f"expected the arm's own kinematics to bring the tool within {1e3 * TOOL_M:g} mm of where the file's do, "
            f"they are {1e3 * away_m:.1f} mm apart: is its calibration its own, are its joints' zeros where they were?"
        )


def _postures(facts: ArmFacts, arm: ArmConfig) -> Iterator[Vec6]:
    """Yield joints at which two kinematics are compared: where the arm stands, at home, each joint turned there."""
    yield facts.q_rad
    yield arm.home_rad
    for i in range(len(arm.home_rad)):
        for turn_rad in (-AROUND_RAD, AROUND_RAD):
            yield vec6([q + turn_rad * (i == k) for k, q in enumerate(arm.home_rad)])


def check_pose(facts: ArmFacts) -> None:
    """Refuse an arm whose own kinematics do not bring its joints to where it says its tool is.

    Raises:
        RobotConfigError: they differ by more than 0.1 mm or 1 mrad.
    """
    T_bt = flange_pose(facts, facts.q_rad) @ _matrix(facts.tcp_offset)
    away_m = float(np.linalg.norm(T_bt[:3, 3] - np.asarray(facts.tcp_pose[:3])))
    turn = T_bt[:3, :3].T @ _matrix(facts.tcp_pose)[:3, :3]
    away_rad = math.acos(min(max((float(np.trace(turn)) - 1.0) / 2.0, -1.0), 1.0))
    if not (away_m <= POSE_M and away_rad <= POSE_RAD):
        raise RobotConfigError(
            f"expected the arm's tool where its joints bring it, within {1e3 * POSE_M:g} mm and {1e3 * POSE_RAD:g} "
            f"mrad; it is {1e3 * away_m:.3f} mm and {1e3 * away_rad:.2f} mrad off: is its calibration whole?"
        )


def tool_off_m(facts: ArmFacts, arm: ArmConfig, q_rad: Sequence[float]) -> float:
    """Return how far the arm's own kinematics bring the file's tool from where the file's kinematics do.  (6,) -> ()"""
    its_m = flange_pose(facts, q_rad) @ (*arm.tool.tcp_m, 1.0)
    ours_m = part_points(arm, q_rad)[ArmPart.TCP]
    return math.dist(its_m[:3].tolist(), ours_m)


def flange_pose(facts: ArmFacts, q_rad: Sequence[float]) -> np.ndarray:
    """Return T_bf by the arm's own Denavit-Hartenberg rows, Rz(q) Tz(d) Tx(a) Rx(alpha).  (6,) -> (4, 4)"""
    T = np.eye(4)
    for q, theta, a, d, alpha in zip(q_rad, facts.theta_rad, facts.a_m, facts.d_m, facts.alpha_rad, strict=True):
        c, s, ca, sa = math.cos(q + theta), math.sin(q + theta), math.cos(alpha), math.sin(alpha)
        T = T @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0.0, sa, ca, d], [0.0, 0.0, 0.0, 1.0]]
        )
    return T


def _matrix(pose: Sequence[float]) -> np.ndarray:
    w, x, y, z = quat_of_rotation_vector(pose[3], pose[4], pose[5])
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = pose[:3]
    return T
