"""Arm and table for viewers: frames that move, and shapes that hang on them. Pure but for what was drawn last.

Every link and every thing has a frame; shapes are told once and when they change (a lamp goes on), frames with every
percept. Arms are drawn as the capsules that safety keeps apart, so what is seen is what is checked.
"""

import math

from config.arm import ArmConfig, Capsule
from config.scenario import Box, Button, Cylinder, Scenario
from robot import viewer_messages as v
from robot.messages import ArmState, Percept, Quat, Vec3

__all__ = ["Picture"]

BASE, TOOL = "base", "tool"
ARM_COLOUR = v.Colour(0.62, 0.66, 0.72)
TOOL_COLOUR = v.Colour(0.25, 0.26, 0.28)
TABLE_M = 0.02
UNLIT = 0.35
LIT = 0.5


class Picture:
    """Draws what one arm and one table look like.

    Args:
        arm: the arm's file.
        scenario: the table.
    """

    def __init__(self, arm: ArmConfig, scenario: Scenario) -> None:
        self._arm, self._scenario = arm, scenario
        self._links = [_half_twist(joint.alpha_rad) for joint in arm.joints]
        self._lit: tuple[bool, ...] | None = None

    def frames(self, state: ArmState | None, percept: Percept) -> v.FrameTransforms:
        """Return where links and things are; without a measurement, the tool alone."""
        at = v.stamp_of(percept.stamp_ns)
        found = [_frame(at, BASE, thing.name, thing.position_m, thing.quat) for thing in percept.objects]
        if state is not None:
            found += self._arm_frames(at, state)
        return v.FrameTransforms(transforms=tuple(found))

    def scene(self, percept: Percept) -> v.SceneUpdate | None:
        """Return shapes that are new or others now, None where nothing is."""
        lit = tuple(state > LIT for state in percept.button_states)
        before, self._lit = self._lit, lit
        at = v.stamp_of(percept.stamp_ns)
        if before is None:
            return v.SceneUpdate(entities=(*self._standing(at), *self._buttons(at, lit)))
        changed = [i for i, (was, now) in enumerate(zip(before, lit, strict=True)) if was != now]
        if not changed:
            return None
        return v.SceneUpdate(entities=tuple(entity for i, entity in enumerate(self._buttons(at, lit)) if i in changed))

    def _arm_frames(self, at: v.Stamp, state: ArmState) -> list[v.FrameTransform]:
        found, parent = [], BASE
        for i, (joint, q, (ca, sa)) in enumerate(zip(self._arm.joints, state.q_rad, self._links, strict=True), start=1):
            c, s, h_c, h_s = math.cos(q), math.sin(q), math.cos(q / 2), math.sin(q / 2)
            quat = (h_c * ca, h_c * sa, h_s * sa, h_s * ca)
            name = f"link_{i}"
            found.append(_frame(at, parent, name, (joint.a_m * c, joint.a_m * s, joint.d_m), quat))
            parent = name
        found.append(_frame(at, parent, TOOL, self._arm.tool.tcp_m, (1.0, 0.0, 0.0, 0.0)))
        for name, side in (("finger_left", 1.0), ("finger_right", -1.0)):
            found.append(_frame(at, TOOL, name, (0.0, side * state.grip.opening_m / 2, 0.0), (1.0, 0.0, 0.0, 0.0)))
        return found

    def _standing(self, at: v.Stamp) -> list[v.SceneEntity]:
        table, arm = self._scenario.table, self._arm
        x, y = table.centre_m
        slab = v.Cube(
            pose=v.Pose(position=v.Vector(x, y, table.height_m - TABLE_M / 2)),
            size=v.Vector(*table.size_m, TABLE_M), color=v.Colour(*table.colour),
        )  # fmt: skip
        found = [v.SceneEntity(timestamp=at, frame_id=BASE, id="table", cubes=(slab,))]
        for link in range(7):
            shapes = [_tube(c) for c in arm.capsules if c.link == link]
            if shapes:
                cylinders, balls = zip(*shapes, strict=True)
                frame = f"link_{link}" if link else BASE
                found.append(
                    v.SceneEntity(
                        timestamp=at, frame_id=frame, id=f"arm/{link}", cylinders=cylinders,
                        spheres=tuple(ball for pair in balls for ball in pair),
                    )
                )  # fmt: skip
        thick, wide, tall = arm.tool.pad_size_m
        for name, side in (("finger_left", 1.0), ("finger_right", -1.0)):
            pad = v.Cube(
                pose=v.Pose(position=v.Vector(0.0, side * thick / 2, 0.0)), size=v.Vector(wide, thick, tall),
                color=TOOL_COLOUR,
            )  # fmt: skip
            found.append(v.SceneEntity(timestamp=at, frame_id=name, id=name, cubes=(pad,)))
        found += [_box(at, box) for box in self._scenario.boxes]
        found += [_cylinder(at, thing) for thing in self._scenario.cylinders]
        return found

    def _buttons(self, at: v.Stamp, lit: tuple[bool, ...]) -> list[v.SceneEntity]:
        return [_button(at, button, is_lit) for button, is_lit in zip(self._scenario.buttons, lit, strict=True)]


def _half_twist(alpha_rad: float) -> tuple[float, float]:
    return math.cos(alpha_rad / 2), math.sin(alpha_rad / 2)


def _frame(at: v.Stamp, parent: str, child: str, position: Vec3, quat: Quat) -> v.FrameTransform:
    w, x, y, z = quat
    return v.FrameTransform(
        timestamp=at, parent_frame_id=parent, child_frame_id=child, translation=v.Vector(*position),
        rotation=v.Quaternion(x, y, z, w),
    )  # fmt: skip


def _tube(capsule: Capsule) -> tuple[v.Cylinder, tuple[v.Sphere, v.Sphere]]:
    """Return a capsule as a cylinder and the balls at its ends."""
    ends = capsule.from_m, capsule.to_m
    way = [b - a for a, b in zip(*ends, strict=True)]
    length = math.hypot(*way) or 1e-6
    x, y, z = (a / length for a in way)
    w = math.sqrt(max(0.0, (1.0 + z) / 2.0))
    turn = v.Quaternion(-y / (2 * w), x / (2 * w), 0.0, w) if w > 1e-6 else v.Quaternion(1.0, 0.0, 0.0, 0.0)
    middle = v.Vector(*((a + b) / 2 for a, b in zip(*ends, strict=True)))
    wide = 2 * capsule.radius_m
    balls = [
        v.Sphere(pose=v.Pose(position=v.Vector(*end)), size=v.Vector(wide, wide, wide), color=ARM_COLOUR)
        for end in ends
    ]
    tube = v.Cylinder(
        pose=v.Pose(position=middle, orientation=turn), size=v.Vector(wide, wide, length), color=ARM_COLOUR
    )
    return tube, (balls[0], balls[1])


def _button(at: v.Stamp, button: Button, is_lit: bool) -> v.SceneEntity:
    r, g, b = (
        (1.0 if is_lit else UNLIT) * button.colour[0],
        *[(1.0 if is_lit else UNLIT) * c for c in button.colour[1:]],
    )
    shape = v.Cylinder(
        pose=v.Pose(position=v.Vector(0.0, 0.0, -button.height_m / 2)),
        size=v.Vector(button.diameter_m, button.diameter_m, button.height_m), color=v.Colour(r, g, b),
    )  # fmt: skip
    return v.SceneEntity(timestamp=at, frame_id=button.name, id=button.name, cylinders=(shape,))


def _cylinder(at: v.Stamp, thing: Cylinder) -> v.SceneEntity:
    shape = v.Cylinder(
        pose=v.Pose(), size=v.Vector(thing.diameter_m, thing.diameter_m, thing.height_m), color=v.Colour(*thing.colour)
    )
    return v.SceneEntity(timestamp=at, frame_id=thing.name, id=thing.name, cylinders=(shape,))


def _box(at: v.Stamp, box: Box) -> v.SceneEntity:
    """Return the walls of a box; lids are not drawn, nothing perceives their angle."""
    (long, wide), wall, tall = box.inner_m, box.wall_m, box.height_m
    walls = [
        ((side * (long + wall) / 2, 0.0), (wall, wide + 2 * wall)) for side in (1.0, -1.0)
    ] + [((0.0, side * (wide + wall) / 2), (long, wall)) for side in (1.0, -1.0)]  # fmt: skip
    cubes = [
        v.Cube(
            pose=v.Pose(position=v.Vector(x, y, tall / 2)), size=v.Vector(a, b, tall), color=v.Colour(*box.colour, 0.6)
        )
        for (x, y), (a, b) in walls
    ]
    return v.SceneEntity(timestamp=at, frame_id=box.name, id=box.name, cubes=tuple(cubes))
