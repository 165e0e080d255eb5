"""Plants that are not what their controllers believe: the physics is changed, nobody is told."""

import msgspec
import mujoco

from config.arm import ArmConfig
from config.resolved import Resolved
from sim_twin.plant import TwinPlant

__all__ = ["NOMINAL", "PERTURBATIONS", "Perturbation", "perturbed_arm", "perturbed_plant"]


class Perturbation(msgspec.Struct, frozen=True, kw_only=True):
    """How a plant differs from its file."""

    name: str
    lag_factor: float = 1.0
    """Times the servo's look-ahead and dead time."""
    braking_factor: float = 1.0
    """Times the deceleration of the arm's own stop."""
    payload_kg: float = 0.0
    """Mass in the hand that weight compensation knows nothing of; negative: it counts on one that is absent."""
    kinematics_m: float = 0.0
    """Added to the length of both arm links and of the tool."""


NOMINAL = Perturbation(name="nominal")
PERTURBATIONS = (
    NOMINAL,
    Perturbation(name="lag_x2", lag_factor=2.0),
    Perturbation(name="braking_half", braking_factor=0.5),
    Perturbation(name="payload_plus_1kg", payload_kg=1.0),
    Perturbation(name="payload_minus_1kg", payload_kg=-1.0),
    Perturbation(name="kinematics_plus_2mm", kinematics_m=0.002),
)
"""Those that a check goes through, the nominal plant first."""


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


def perturbed_plant(resolved: Resolved, by: Perturbation) -> TwinPlant:
    """Return a twin whose physics is perturbed; a station on it is built from the files as they are."""
    plant = TwinPlant(arm=perturbed_arm(resolved.arm, by), scenario=resolved.scenario, rig=resolved.rig)
    world = plant.world
    world.stop_rad_s2 *= by.braking_factor
    if by.payload_kg:
        _load(world.model, by.payload_kg)
    return plant


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
