"""The arm's model from its file: kinematics and the MuJoCo description that gate, solver and twin build on.

Frames follow the standard Denavit-Hartenberg convention that UR publishes: the transform from DH frame i to i-1 is
``Rz(q_i) Tz(d_i) Tx(a_i) Rx(alpha_i)``. A MuJoCo body ``link_i`` is DH frame i-1 turned by q_i, so that its hinge is
its own z axis; what the file gives in DH frame i is carried over by the constant part of the row.
"""

from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig, Joint
from robot.appearance import dress_arm, dress_tool

__all__ = [
    "ARM_CONTACT",
    "BUMPER_SOLIMP",
    "BUMPER_SOLREF",
    "FIXTURE_CONTACT",
    "GRIP_SOLIMP",
    "GRIP_SOLREF",
    "OBJECT_CONTACT",
    "arm_model",
    "arm_spec",
    "dh_constant",
    "forward_kinematics",
    "tool_down",
    "tool_transform",
    "write_mjcf",
]

Array = NDArray[np.float64]

# Contact classes: what may touch what. (contype & conaffinity of either side must meet.)
ARM_CONTACT = (1, 0)
OBJECT_CONTACT = (2, 3)
FIXTURE_CONTACT = (0, 3)
# A hard, hardly creeping contact for gripping; a rubber foot under the fingers that gives some 8 N/mm.
GRIP_SOLREF = (0.004, 1.0)
GRIP_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
BUMPER_SOLREF = (0.035, 1.0)
BUMPER_SOLIMP = (0.2, 0.95, 0.01, 0.5, 2.0)


def dh_constant(joint: Joint) -> Array:
    """Return Tz(d) Tx(a) Rx(alpha) of one row.  () -> (4, 4)"""
    c, s = np.cos(joint.alpha_rad), np.sin(joint.alpha_rad)
    return np.array([[1.0, 0.0, 0.0, joint.a_m], [0.0, c, -s, 0.0], [0.0, s, c, joint.d_m], [0.0, 0.0, 0.0, 1.0]])


def tool_transform(arm: ArmConfig) -> Array:
    """Return T_ft, tool centre point to flange.  () -> (4, 4)"""
    T_ft = np.eye(4)
    T_ft[:3, 3] = arm.tool.tcp_m
    return T_ft


def tool_down(yaw_rad: float) -> Array:
    """Return R_bt of a tool that points straight down; at yaw 0 its jaws move along the base's y axis.  () -> (3, 3)"""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])


def forward_kinematics(arm: ArmConfig, q_rad: tuple[float, ...] | Array, *, frame: str = "tcp") -> Array:
    """Return T_bt (frame "tcp") or T_bf (frame "flange").  (6,) -> (4, 4)

    Raises:
        ValueError: frame is neither.
    """
    if frame not in ("tcp", "flange"):
        raise ValueError(f"frame: expected 'tcp' or 'flange', got {frame!r}")
    T = np.eye(4)
    for joint, q in zip(arm.joints, q_rad, strict=True):
        c, s = np.cos(q), np.sin(q)
        R_z = np.array([[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
        T = T @ R_z @ dh_constant(joint)
    return T @ tool_transform(arm) if frame == "tcp" else T


def arm_spec(arm: ArmConfig) -> mujoco.MjSpec:
    """Return arm and gripper alone as an MjSpec that compiles.

    Bodies ``link_0`` .. ``link_6``, ``tool``, ``finger_left``, ``finger_right``; hinges named as the file's joints;
    sites ``flange`` and ``tcp``. World is the base frame. No actuators: who simulates adds them.
    """
    spec = mujoco.MjSpec()
    spec.modelname = arm.name
    spec.compiler.degree = False
    body = spec.worldbody.add_body(name="link_0", gravcomp=1)
    dress_arm(body, 0)
    _add_capsules(body, arm, 0, np.eye(4))
    T = np.eye(4)
    for i, joint in enumerate(arm.joints, start=1):
        body = body.add_body(name=f"link_{i}", pos=T[:3, 3], quat=_quat(T), gravcomp=1)
        T = dh_constant(joint)
        body.add_joint(
            name=joint.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1], range=joint.range_rad,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE, armature=0.1,
        )  # fmt: skip
        _add_inertia(body, arm, i, T)
        _add_capsules(body, arm, i, T)
        dress_arm(body, i, T)
    _add_tool(body, arm, T)
    return spec


def arm_model(arm: ArmConfig) -> mujoco.MjModel:
    """Return the compiled arm alone, for kinematics and collision."""
    return arm_spec(arm).compile()


def write_mjcf(arm: ArmConfig, path: Path) -> None:
    """Write the arm alone as MJCF, for solvers that read files."""
    spec = arm_spec(arm)
    spec.compile()
    path.write_text(spec.to_xml(), encoding="utf-8")


def _quat(T: Array) -> Array:
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, T[:3, :3].ravel().copy())
    return quat


def _apply(T: Array, point: tuple[float, float, float]) -> Array:
    return T[:3, :3] @ np.asarray(point) + T[:3, 3]


def _add_inertia(body: mujoco.MjsBody, arm: ArmConfig, i: int, T: Array) -> None:
    """Mass and centre from the file; inertia of a solid cylinder along the link's capsule (UR publishes none)."""
    joint = arm.joints[i - 1]
    capsule = next((c for c in arm.capsules if c.link == i), None)
    span = np.subtract(capsule.to_m, capsule.from_m) if capsule else np.array([0.0, 0.0, 0.05])
    radius = capsule.radius_m if capsule else 0.04
    length = float(np.linalg.norm(span)) + radius
    quat = np.zeros(4)
    mujoco.mju_quatZ2Vec(quat, np.ascontiguousarray(T[:3, :3] @ span))
    across = joint.mass_kg * (3.0 * radius**2 + length**2) / 12.0
    body.explicitinertial = True
    body.mass = joint.mass_kg
    body.ipos = _apply(T, joint.com_m)
    body.iquat = quat
    body.inertia = [across, across, 0.5 * joint.mass_kg * radius**2]


def _add_capsules(body: mujoco.MjsBody, arm: ArmConfig, i: int, T: Array) -> None:
    for k, capsule in enumerate(c for c in arm.capsules if c.link == i):
        ends = np.concatenate([_apply(T, capsule.from_m), _apply(T, capsule.to_m)])
        contype, conaffinity = ARM_CONTACT if i else (0, 0)
        body.add_geom(
            name=f"capsule_{i}_{k}", type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=[capsule.radius_m, 0, 0],
            contype=contype, conaffinity=conaffinity, group=3, mass=0,
        )  # fmt: skip


def _add_tool(link_6: mujoco.MjsBody, arm: ArmConfig, T_6f: Array) -> None:
    """Palm and two sliding fingers; the flange frame is the tool's own frame."""
    tool = arm.tool
    body = link_6.add_body(name="tool", pos=T_6f[:3, 3], quat=_quat(T_6f), gravcomp=1)
    body.explicitinertial = True
    finger_mass = 0.06
    body.mass = tool.mass_kg - 2 * finger_mass
    body.ipos = tool.com_m
    body.inertia = [0.0012, 0.0012, 0.0006]
    body.add_site(name="flange", pos=[0, 0, 0])
    body.add_site(name="tcp", pos=tool.tcp_m)
    palm_end = tool.tcp_m[2] - tool.finger_depth_m
    contype, conaffinity = ARM_CONTACT
    body.add_geom(
        name="palm", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.032, 0.06, palm_end / 2], pos=[0, 0, palm_end / 2],
        contype=contype, conaffinity=conaffinity, group=3, mass=0,
    )  # fmt: skip
    for side, name in ((1.0, "left"), (-1.0, "right")):
        _add_finger(body, arm, name, side, finger_mass)
    dress_tool(body, arm)


def _add_finger(palm: mujoco.MjsBody, arm: ArmConfig, name: str, side: float, mass: float) -> None:
    """One finger: a hard pad that grips, a soft bumper under it that meets the table, a back that joins the palm.

    The slide coordinate is half the opening: 0 is shut, stroke / 2 is open.
    """
    tool = arm.tool
    thick, wide, tall = tool.pad_size_m
    tip_z = tool.tcp_m[2] + tool.tip_below_tcp_m
    bumper = 0.008  # of rubber that gives: a stiff fingertip meets what it runs into with 700 N
    body = palm.add_body(name=f"finger_{name}", gravcomp=1)
    body.explicitinertial = True
    body.mass = mass
    body.ipos = [0, side * thick / 2, tool.tcp_m[2] - 0.02]
    body.inertia = [6e-5, 6e-5, 1e-5]
    body.add_joint(
        name=f"finger_{name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, side, 0], range=[0, tool.stroke_m / 2],
        limited=mujoco.mjtLimited.mjLIMITED_TRUE, damping=5.0, armature=0.2,
        solref_limit=GRIP_SOLREF, solimp_limit=GRIP_SOLIMP,
    )  # fmt: skip
    box = mujoco.mjtGeom.mjGEOM_BOX
    contype, conaffinity = ARM_CONTACT
    common = {"contype": contype, "conaffinity": conaffinity, "mass": 0}
    y = side * thick / 2
    inset = thick - 0.003  # bumper and back stand back from the pad's face, so that only the pad grips
    y_inset = side * (thick - inset / 2)
    body.add_geom(
        name=f"pad_{name}", type=box, size=[wide / 2, thick / 2, tall / 2], pos=[0, y, tip_z - bumper - tall / 2],
        condim=4, friction=[0.1, 0.003, 0.0001], solref=GRIP_SOLREF, solimp=GRIP_SOLIMP,
        rgba=[0.13, 0.13, 0.14, 1], group=2, **common,
    )  # fmt: skip
    body.add_geom(
        name=f"bumper_{name}", type=box, size=[wide / 2, inset / 2, bumper / 2], pos=[0, y_inset, tip_z - bumper / 2],
        condim=3, friction=[0.6, 0.01, 0.0001], solref=BUMPER_SOLREF, solimp=BUMPER_SOLIMP, priority=1,
        rgba=[0.30, 0.31, 0.33, 1], group=2, **common,
    )  # fmt: skip
    top, bottom = tool.tcp_m[2] - tool.finger_depth_m, tip_z - bumper - tall
    body.add_geom(
        name=f"back_{name}", type=box, size=[wide / 2.6, inset / 2, (bottom - top) / 2],
        pos=[0, y_inset, (top + bottom) / 2], rgba=[0.22, 0.23, 0.25, 1], group=2, **common,
    )  # fmt: skip
