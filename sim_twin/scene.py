"""The simulated table as an MjSpec, from the arm's file and the scenario's.

Everything is a body with mass and contacts: buttons are sprung slides, lids are leaves on hinges driven by weak
actuators and locked by a joint equality only when shut, cylinders are free bodies. Nothing is ever welded.
"""

import mujoco
import numpy as np

from config.arm import ArmConfig
from config.scenario import Box, Button, Cylinder, Scenario
from config.values import Point
from robot.description import (
    BUMPER_SOLIMP,
    BUMPER_SOLREF,
    FIXTURE_CONTACT,
    GRIP_SOLIMP,
    GRIP_SOLREF,
    OBJECT_CONTACT,
)
from sim_twin.fitted import add_servos, fitted_spec
from sim_twin.names import on_table

__all__ = ["build_scene", "leaf_names"]

FINGER_STIFFNESS = 6_000.0  # N/m
_BOX = mujoco.mjtGeom.mjGEOM_BOX
_CYLINDER = mujoco.mjtGeom.mjGEOM_CYLINDER
_FIXTURE = {"contype": FIXTURE_CONTACT[0], "conaffinity": FIXTURE_CONTACT[1]}
# Boxes and lids wear padding that gives way under a finger: a hand that strikes a lid's edge is not broken.
_PADDED = {**_FIXTURE, "friction": [0.6, 0.01, 0.0001], "solref": [0.03, 1.0], "priority": 1}
# A finger that came down beside a button bent its rubber foot out of the way, and the bare pad above it caught the rim
# with 700 N: rings are as soft to a pad as they are to the foot. Caps are not: a pad would sink in, not press.
_RIMMED = {
    **_FIXTURE, "friction": [0.6, 0.01, 0.0001], "solref": BUMPER_SOLREF, "solimp": BUMPER_SOLIMP, "priority": 1
}  # fmt: skip
N_FACETS = 32
"""Of a disc: its rim is round to 0.3 mm."""
_LOOK = {"contype": 0, "conaffinity": 0, "mass": 0, "group": 1}


def build_scene(arm: ArmConfig, scenario: Scenario, *, physics_s: float, tick_s: float) -> mujoco.MjSpec:
    """Return the whole world: arm, gripper, table, buttons, boxes, lids, cylinders, actuators and sensors."""
    spec = fitted_spec(arm)
    spec.modelname = f"{arm.name}_{scenario.name}"
    _set_options(spec, physics_s)
    _add_surroundings(spec, scenario)
    for button in scenario.buttons:
        _add_button(spec, button, scenario.table.height_m)
    for box in scenario.boxes:
        _add_box(spec, box, scenario.table.height_m)
    for cylinder in scenario.cylinders:
        _add_cylinder(spec, cylinder)
    add_servos(spec, arm, physics_s=physics_s, tick_s=tick_s)
    _add_grip(spec, arm)
    spec.add_sensor(
        name="tool_force", type=mujoco.mjtSensor.mjSENS_CONTACT, objtype=mujoco.mjtObj.mjOBJ_XBODY, objname="tool",
        intprm=[1 << int(mujoco.mjtConDataField.mjCONDATA_FORCE), 3, 1],
    )  # fmt: skip
    return spec


def leaf_names(box: Box) -> tuple[str, str]:
    """Return the joint names of a box's two lid leaves."""
    return on_table(box.name, "leaf_near"), on_table(box.name, "leaf_far")


def _set_options(spec: mujoco.MjSpec, physics_s: float) -> None:
    option = spec.option
    option.timestep = physics_s
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10.0
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)  # what lies still costs nothing
    option.tolerance = 1e-7
    option.iterations = 30


def _add_surroundings(spec: mujoco.MjSpec, scenario: Scenario) -> None:
    table = scenario.table
    world = spec.worldbody
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1280, 960
    spec.visual.quality.shadowsize = 4096
    spec.visual.headlight.ambient = [0.38, 0.38, 0.40]
    spec.visual.headlight.diffuse = [0.32, 0.32, 0.32]
    spec.visual.headlight.specular = [0.1, 0.1, 0.1]
    spec.visual.map.znear = 0.02
    world.add_light(pos=[0.2, -0.9, 1.7], dir=[0.1, 0.6, -1.0], diffuse=[0.55, 0.54, 0.52], castshadow=True)
    world.add_light(pos=[1.3, 0.9, 1.6], dir=[-0.6, -0.5, -1.0], diffuse=[0.22, 0.23, 0.25], castshadow=False)
    x, y = table.centre_m
    world.add_geom(
        name="table", type=mujoco.mjtGeom.mjGEOM_PLANE, pos=[x, y, table.height_m], size=[2, 2, 0.1], group=3,
        rgba=[0, 0, 0, 0], condim=3, friction=[0.8, 0.01, 0.0001], **_FIXTURE,
    )  # fmt: skip
    half = [table.size_m[0] / 2, table.size_m[1] / 2, 0.02]
    world.add_geom(type=_BOX, pos=[x, y, table.height_m - 0.0205], size=half, rgba=[*table.colour, 1], **_LOOK)
    world.add_geom(
        type=_BOX, pos=[-0.02, 0, table.height_m - 0.03], size=[0.16, 0.2, 0.03], rgba=[0.32, 0.33, 0.35, 1], **_LOOK
    )
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.86, 0.89, 0.92], rgb2=[0.62, 0.66, 0.70], width=64, height=384,
    )  # fmt: skip
    world.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, pos=[0, 0, table.height_m - 0.75], size=[4, 4, 0.1],
        rgba=[0.70, 0.71, 0.72, 1], **_LOOK,
    )  # fmt: skip
    _add_camera(world, eye=(1.62, -1.12, 1.12), target=(0.30, -0.02, 0.20))


def _add_camera(world: mujoco.MjsBody, *, eye: Point, target: Point) -> None:
    """The overview: looks from eye to target, base frame, up is up."""
    back = np.subtract(eye, target)
    right = np.cross([0.0, 0.0, 1.0], back)
    up = np.cross(back, right)
    axes = np.concatenate([right / np.linalg.norm(right), up / np.linalg.norm(up)])
    world.add_camera(name="overview", pos=eye, xyaxes=axes, fovy=36)


def _add_button(spec: mujoco.MjSpec, button: Button, table_m: float) -> None:
    """A cap on a preloaded spring inside a dark ring; the cap wears a dome."""
    radius = button.diameter_m / 2
    cap_half = button.cap_m / 2
    base = spec.worldbody.add_body(name=on_table(button.name), pos=[*button.position_m, table_m])
    ring = button.height_m - button.travel_m - 2 * cap_half
    base.add_geom(
        type=_CYLINDER, size=[radius + 0.006, ring / 2, 0], pos=[0, 0, ring / 2], rgba=[0.16, 0.17, 0.18, 1], **_LOOK
    )
    _add_disc(base, spec, radius + 0.006, ring / 2, pos=[0, 0, ring / 2], **_RIMMED)
    cap = base.add_body(name=on_table(button.name, "cap"), pos=[0, 0, button.height_m - cap_half])
    cap.add_joint(
        name=on_table(button.name, "travel"), type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, -1],
        range=[0, button.travel_m], limited=mujoco.mjtLimited.mjLIMITED_TRUE, stiffness=800.0, springref=-0.004,
        damping=4.0, solref_limit=[0.008, 1.0],
    )  # fmt: skip
    cap.add_geom(
        name=on_table(button.name, "cap"), type=_CYLINDER, size=[radius, cap_half, 0], rgba=[*button.colour, 1], **_LOOK
    )
    _add_disc(cap, spec, radius, cap_half, mass=0.05, friction=[0.6, 0.01, 0.0001], **_FIXTURE)
    cap.add_geom(
        name=on_table(button.name, "dome"), type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        size=[radius * 0.97, radius * 0.97, round(1.5 * button.dome_m, 9)], pos=[0, 0, cap_half - button.dome_m / 2],
        rgba=[*button.colour, 1], **_LOOK,
    )  # fmt: skip


def _add_disc(
    body: mujoco.MjsBody, spec: mujoco.MjSpec, radius_m: float, half_m: float, **how: float | list[float]
) -> None:
    """Add what a hand meets of a button: a disc, as a prism, and not as a cylinder.

    Where a box has sunk into a cylinder's side MuJoCo 4.0.0, looking for more than one point of contact, tells half a
    millimetre across the box's own way instead of the depth along it (test_scene.py): a finger slid 9 mm into a ring,
    felt 20 N, and was then pressed from three sides at once with 270.
    """
    name = f"disc_{radius_m:g}_{half_m:g}"
    if spec.mesh(name) is None:
        turns = 2.0 * np.pi * np.arange(N_FACETS) / N_FACETS
        around = np.stack([radius_m * np.cos(turns), radius_m * np.sin(turns)], axis=1)
        corners = [[*place, z] for place in around.tolist() for z in (-half_m, half_m)]
        spec.add_mesh(name=name, uservert=np.ravel(corners))
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, group=3, **how)


def _add_box(spec: mujoco.MjSpec, box: Box, table_m: float) -> None:
    """Four walls on the table, and two lid leaves hinged at the walls that face the robot and look away from it."""
    (lx, ly), w, h = box.inner_m, box.wall_m, box.height_m
    body = spec.worldbody.add_body(name=on_table(box.name), pos=[*box.position_m, table_m])
    body.add_geom(type=_BOX, size=[lx / 2, ly / 2, 0.0006], pos=[0, 0, 0.0004], rgba=[*_dim(box.colour), 1], **_LOOK)
    for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
        size = [w / 2, ly / 2 + w, h / 2] if axis == 0 else [lx / 2, w / 2, h / 2]
        pos = [0.0, 0.0, h / 2]
        pos[axis] = sign * ((lx if axis == 0 else ly) / 2 + w / 2)
        body.add_geom(type=_BOX, size=size, pos=pos, rgba=[*box.colour, 1], **_PADDED)
    if box.lid is None:
        return
    leaf = lx / 2 + w / 2
    thick, padding = box.lid.thickness_m, box.lid.padding_m
    # A finger that pressed through a thin leaf to its middle was pushed out below, and stuck there: hence the padding.
    for name, sign in zip(leaf_names(box), (-1, 1), strict=True):
        hinge = body.add_body(name=name, pos=[sign * leaf, 0, h + thick / 2])
        span = [-0.02, box.lid.open_angle_rad + 0.05]
        hinge.add_joint(
            name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, sign, 0], range=span,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE, damping=0.02, armature=0.0005,
        )  # fmt: skip
        hinge.add_geom(
            name=name, type=_BOX, size=[(leaf - 0.001) / 2, ly / 2 + w, (thick + padding) / 2],
            pos=[-sign * (leaf - 0.001) / 2, 0, padding / 2], mass=0.06, rgba=[*_dim(box.colour, 0.86), 1],
            **_PADDED,
        )  # fmt: skip
        torque = box.lid.force_n * leaf
        drive = spec.add_actuator(
            name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name, forcerange=[-torque, torque],
            forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        )  # fmt: skip
        drive.set_to_position(kp=2.0, kv=0.08)
        spec.add_equality(
            name=f"{name}/lock", type=mujoco.mjtEq.mjEQ_JOINT, name1=name, objtype=mujoco.mjtObj.mjOBJ_JOINT,
            data=[0.0] * 12, active=False, solref=[0.01, 1.0],
        )  # fmt: skip


def _add_cylinder(spec: mujoco.MjSpec, cylinder: Cylinder) -> None:
    body = spec.worldbody.add_body(name=on_table(cylinder.name), pos=[*cylinder.position_m, cylinder.height_m / 2])
    body.add_freejoint(name=on_table(cylinder.name))
    contype, conaffinity = OBJECT_CONTACT
    body.add_geom(
        name=on_table(cylinder.name), type=_CYLINDER, size=[cylinder.diameter_m / 2, cylinder.height_m / 2, 0],
        mass=cylinder.mass_kg, friction=[cylinder.friction, 0.005, 0.0001], condim=3, rgba=[*cylinder.colour, 1],
        solref=GRIP_SOLREF, solimp=GRIP_SOLIMP, contype=contype, conaffinity=conaffinity,
    )  # fmt: skip


def _add_grip(spec: mujoco.MjSpec, arm: ArmConfig) -> None:
    """One actuator on the opening; the linkage that keeps a real gripper's fingers symmetric is a joint equality."""
    tendon = spec.add_tendon(name="opening")
    tendon.wrap_joint("finger_left", 1.0)
    tendon.wrap_joint("finger_right", 1.0)
    force = arm.tool.grip_force_n
    actuator = spec.add_actuator(
        name="grip", trntype=mujoco.mjtTrn.mjTRN_TENDON, target="opening", forcerange=[-force, force],
        forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE,
    )  # fmt: skip
    actuator.set_to_position(kp=FINGER_STIFFNESS, kv=60.0)
    spec.add_equality(
        name="linkage", type=mujoco.mjtEq.mjEQ_JOINT, name1="finger_left", name2="finger_right",
        objtype=mujoco.mjtObj.mjOBJ_JOINT, data=[0.0, 1.0, *([0.0] * 10)], active=True, solref=[0.004, 1.0],
        solimp=[0.98, 0.999, 0.001, 0.5, 2],
    )  # fmt: skip


def _dim(colour: tuple[float, float, float], by: float = 0.6) -> tuple[float, float, float]:
    r, g, b = colour
    return (r * by, g * by, b * by)
