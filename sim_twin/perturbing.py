"""A plant becomes another than its controller believes: its arm, its masses, its friction, what it tells."""

import msgspec
import mujoco

from config.arm import ArmConfig
from config.perturbation import Perturbation
from robot.messages import Vec3

__all__ = ["moved", "perturb_model", "perturbed_arm"]


def perturbed_arm(arm: ArmConfig, by: Perturbation) -> ArmConfig:
    """Return the file that describes the perturbed arm, for the plant alone."""
    servo, tool = arm.servo, arm.tool
    x, y, z = tool.tcp_m
    joints = list(arm.joints)
    for i, joint in enumerate(joints):
        if joint.a_m:
            longer = joint.a_m + (by.kinematics_m if joint.a_m > 0.0 else -by.kinematics_m)
            joints[i] = msgspec.structs.replace(joint, a_m=longer)
    return msgspec.structs.replace(
        arm,
        joints=(joints[0], joints[1], joints[2], joints[3], joints[4], joints[5]),
        servo=msgspec.structs.replace(
            servo,
            lookahead_s=servo.lookahead_s * by.lag_factor,
            dead_time_s=servo.dead_time_s * by.lag_factor,
        ),
        tool=msgspec.structs.replace(tool, tcp_m=(x, y, z + by.kinematics_m)),
    )


def perturb_model(model: mujoco.MjModel, by: Perturbation) -> None:
    """Change the masses and the friction of a compiled world; its compensation of weight stays what it was."""
    if by.payload_kg:
        _load(model, by.payload_kg)
    if by.mass_factor != 1.0:
        _weigh(model, by.mass_factor)
    if by.friction_factor != 1.0:
        for friction in (model.geom_friction, model.pair_friction, model.dof_frictionloss):
            friction *= by.friction_factor


def moved(place_m: Vec3, by_m: Vec3) -> Vec3:
    """Return a place moved.  (3,) m, (3,) m -> (3,) m"""
    (x, y, z), (dx, dy, dz) = place_m, by_m
    return x + dx, y + dy, z + dz


def _load(model: mujoco.MjModel, payload_kg: float) -> None:
    """Put a mass into the hand that is not compensated, or let one be compensated that is not there."""
    tool = model.body("tool").id
    mass = float(model.body_mass[tool])
    if payload_kg > 0.0:
        model.body_mass[tool] = mass + payload_kg
        model.body_inertia[tool] *= (mass + payload_kg) / mass
        model.body_gravcomp[tool] = mass / (mass + payload_kg)
    else:
        model.body_gravcomp[tool] = (mass - payload_kg) / mass
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _weigh(model: mujoco.MjModel, factor: float) -> None:
    """Make all that has a mass heavier or lighter; what is held against its weight is held as if it were not."""
    model.body_mass *= factor
    model.body_inertia *= factor
    model.body_gravcomp /= factor
    mujoco.mj_setConst(model, mujoco.MjData(model))
