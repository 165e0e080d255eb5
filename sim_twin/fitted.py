"""What sessions of one arm showed of it, put into the twin's physics: servos, friction, payload and lengths."""

import math
from typing import NamedTuple

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig
from config.fitted import FittedPlant
from robot.description import arm_spec
from robot.servo import lag_s

__all__ = [
    "HARD_FRICTION",
    "LEAST_LAG_S",
    "SERVO_STIFFNESS",
    "SOLVED",
    "JointServo",
    "Smoothing",
    "add_servos",
    "fitted_spec",
    "joint_servos",
    "nominal_plant",
]

Array = NDArray[np.float64]
# Nm/rad. Droop stays under 0.5 mm with the tool's weight compensated; a servo three times as stiff makes a carried
# object creep 2 mm, because implicitfast changes the velocity step after the contacts were solved.
SERVO_STIFFNESS = (6_000.0, 6_000.0, 6_000.0, 1_200.0, 1_200.0, 1_200.0)
HARD_FRICTION = (0.9999, 0.9999)
"""A joint that sticks stands: MuJoCo's own dry friction creeps in proportion to the load."""
SOLVED = (1e-10, 100)
"""Tolerance and iterations with which that is solved for: with the scene's own a joint stuck or slid by chance, and was
0.4 mrad elsewhere for 1 g more in the hand."""
LEAST_LAG_S = 5e-4
"""Of a servo behind delay and smoothing."""
WHOLE = 1e-9


class JointServo(NamedTuple):
    """One joint's servo as the physics has it."""

    stiffness_nm_rad: float
    damping_nm_s_rad: float
    friction_nm: float


class Smoothing:
    """Two equal first-order stages in implicit steps, joint by joint: a ramp is trailed by exactly their time.

    Args:
        time_s: of both together.
        dt_s: a step.
    """

    def __init__(self, time_s: float, dt_s: float) -> None:
        self._share = dt_s / (dt_s + time_s / 2.0)
        self._middle = self._out = np.zeros(6)

    def seat(self, q_rad: Array) -> None:
        """Be at rest somewhere.  (6,)"""
        self._middle, self._out = np.array(q_rad), np.array(q_rad)

    def step(self, target_rad: Array) -> Array:
        """Advance one step and return the set-point.  (6,) -> (6,)"""
        self._middle = self._middle + self._share * (target_rad - self._middle)
        self._out = self._out + self._share * (self._middle - self._out)
        return self._out


def nominal_plant(arm: ArmConfig) -> FittedPlant:
    """Return an arm's plant as its file has it: what was fitted, or else what its kind is taken to be."""
    if arm.fitted is not None:
        return arm.fitted
    servo = arm.servo
    lag = lag_s(lookahead_s=servo.lookahead_s, gain=servo.gain, dead_time_s=servo.dead_time_s)
    return FittedPlant(
        lag_s=(lag, lag, lag, lag, lag, lag), dead_time_s=servo.dead_time_s, stiffness_nm_rad=SERVO_STIFFNESS
    )


def joint_servos(arm: ArmConfig, tick_s: float) -> tuple[JointServo, ...]:
    """Return each joint's servo.

    A ramp is trailed by damping over stiffness, plus delay and smoothing, plus half a tick because set-points come in
    steps: the damping is chosen so that the sum is the lag.
    """
    plant = nominal_plant(arm)
    before_s = plant.dead_time_s + plant.smoothing_s + tick_s / 2
    each = zip(plant.lag_s, plant.stiffness_nm_rad, plant.friction_nm, strict=True)
    return tuple(JointServo(kp, kp * max(LEAST_LAG_S, lag - before_s), rub) for lag, kp, rub in each)


def add_servos(spec: mujoco.MjSpec, arm: ArmConfig, *, physics_s: float, tick_s: float) -> None:
    """Add position servos; torque limits from the file."""
    fitted = arm.fitted is not None
    servos = joint_servos(arm, tick_s)
    dead_time_s = nominal_plant(arm).dead_time_s
    if any(servo.friction_nm for servo in servos):
        spec.option.tolerance, spec.option.iterations = SOLVED
    n_delay = math.ceil(dead_time_s / physics_s - WHOLE) if fitted else round(dead_time_s / physics_s)
    for joint, servo in zip(arm.joints, servos, strict=True):
        actuator = spec.add_actuator(
            name=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint.name,
            forcerange=[-joint.torque_nm, joint.torque_nm], forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        )  # fmt: skip
        actuator.set_to_position(kp=servo.stiffness_nm_rad, kv=servo.damping_nm_s_rad)
        if servo.friction_nm:
            spec.joint(joint.name).frictionloss = servo.friction_nm
            spec.joint(joint.name).solimp_friction[:2] = HARD_FRICTION
        if n_delay:
            actuator.nsample = n_delay
            actuator.delay = dead_time_s if fitted else n_delay * physics_s
            actuator.interp = 1 if fitted else 0  # linear: a delay need not be whole steps


def _with_rows(arm: ArmConfig) -> ArmConfig:
    """Return the arm with its own lengths, twists aside from the joints' angles."""
    if arm.fitted is None:
        return arm
    joints = [
        msgspec.structs.replace(j, a_m=j.a_m + off.a_m, d_m=j.d_m + off.d_m, alpha_rad=j.alpha_rad + off.alpha_rad)
        for j, off in zip(arm.joints, arm.fitted.rows, strict=True)
    ]
    return msgspec.structs.replace(arm, joints=tuple(joints))


def fitted_spec(arm: ArmConfig) -> mujoco.MjSpec:
    """Return robot.description's arm with what was fitted of it, servos aside."""
    spec = arm_spec(_with_rows(arm))
    fitted = arm.fitted
    if fitted is None:
        return spec
    for i, row in enumerate(fitted.rows, start=1):
        if row.theta_rad:
            _turn(spec.body(f"link_{i}"), row.theta_rad)
    if fitted.payload_kg:
        _load(spec.body("tool"), fitted.payload_kg)
    return spec


def _load(tool: mujoco.MjsBody, payload_kg: float) -> None:
    """Put a mass into the hand that is not compensated; below zero one is compensated that is not there."""
    mass = float(tool.mass)
    if payload_kg > 0.0:
        tool.mass = mass + payload_kg
        tool.inertia = np.array(tool.inertia) * (mass + payload_kg) / mass
        tool.gravcomp = mass / (mass + payload_kg)
    else:
        tool.gravcomp = (mass - payload_kg) / mass


def _turn(body: mujoco.MjsBody, theta_rad: float) -> None:
    """Turn a link about its joint's axis at the angle zero."""
    turn, quat = np.array([math.cos(theta_rad / 2), 0.0, 0.0, math.sin(theta_rad / 2)]), np.zeros(4)
    mujoco.mju_mulQuat(quat, np.array(body.quat, dtype=np.float64), turn)
    body.quat = quat
