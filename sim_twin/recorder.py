"""What the physics did, step by step: the truth that a monitor judges. Takes nothing of motion, gate or limits.

Every physics step of the world is taken alone and what it did is copied, so that nothing between two ticks is missed.
Positions, velocities of points and contacts are those with which a step began, joints those with which it ended: each
is judged by itself, none against the other.
"""

from enum import StrEnum

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.names import on_table
from sim_twin.plant import TwinWorld
from sim_twin.points import elbow_offset

__all__ = ["OWN", "Course", "PartKind", "Placed", "Recorder", "Touch", "part_kinds"]

Array = NDArray[np.float64]
N_JOINTS = 6
ALL_OF = 1.0 - 1e-9
TINY_M = 1e-9
POINTS = ("tcp", "flange", "elbow")


class PartKind(StrEnum):
    """What a geom belongs to, as far as touching goes."""

    FINGERS = "fingers"
    HAND = "hand"
    ARM = "arm"
    TABLE = "table"
    BUTTON = "button"
    OBJECT = "object"
    LID = "lid"
    BOX = "box"
    OTHER = "other"


OWN = frozenset((PartKind.FINGERS, PartKind.HAND, PartKind.ARM))


class Touch(msgspec.Struct, frozen=True):
    """Two parts that touched during one physics step, the arm's first, and what they pressed with (N)."""

    step: int
    own: PartKind
    other: PartKind
    other_name: str
    force_n: float
    """Sum of the normal forces of all contacts between the arm's part and the other body."""
    vector_n: tuple[float, float, float]
    """What they come to together with friction, on the arm's part, base frame."""


class Placed(msgspec.Struct, frozen=True, kw_only=True):
    """Where shapes are at every tick."""

    at_m: Array
    """(ticks, geoms, 3) centres"""
    turned: Array
    """(ticks, geoms, 9) frames"""


class Course(msgspec.Struct, frozen=True, kw_only=True):
    """One stream's truth; the first axis of every array is physics steps, or ticks where that is said."""

    physics_s: float
    n_substeps: int
    q_rad: Array
    """(n, 6)"""
    qd_rad_s: Array
    """(n, 6)"""
    set_point_rad: Array
    """(ticks, 6) what reached the joints' drives"""
    at_torque: NDArray[np.bool_]
    """(n, 6) whether a joint's drive gave all the torque it has"""
    opening_m: Array
    """(n,) distance between the pads"""
    grip_force_n: Array
    """(n,) what the hand's drive presses with"""
    hand_asked: Array
    """(ticks, 3) opening, greatest force and speed that reached the hand's drive; a speed of NaN where it rests"""
    position_m: Array
    """(n, 3, 3) of tcp, flange and elbow, base frame"""
    speed_m_s: Array
    """(n, 3) of tcp, flange and elbow"""
    approach: Array
    """(n, 3) the tool's approach axis, base frame"""
    placed: Placed
    """All geoms"""
    touches: tuple[Touch, ...]
    stopping: NDArray[np.bool_]
    """(n,) the plant's own stop was running"""

    @property
    def n_steps(self) -> int:
        """How many physics steps."""
        return len(self.q_rad)


def part_kinds(world: TwinWorld) -> tuple[PartKind, ...]:
    """Return what each geom of a world belongs to, by the bodies' names in the scene."""
    model, scenario = world.model, world.scenario
    by_body = {"world": PartKind.TABLE, "tool": PartKind.HAND, "finger_left": PartKind.FINGERS}
    by_body |= {"finger_right": PartKind.FINGERS, **{f"link_{i}": PartKind.ARM for i in range(N_JOINTS + 1)}}
    for button in scenario.buttons:
        by_body |= {on_table(button.name): PartKind.BUTTON, on_table(button.name, "cap"): PartKind.BUTTON}
    for box in scenario.boxes:
        by_body[on_table(box.name)] = PartKind.BOX
        if box.lid is not None:
            by_body |= {on_table(box.name, f"leaf_{side}"): PartKind.LID for side in ("near", "far")}
    by_body |= {on_table(c.name): PartKind.OBJECT for c in scenario.cylinders}
    names = (model.body(int(model.geom_bodyid[i])).name for i in range(model.ngeom))
    return tuple(by_body.get(name, PartKind.OTHER) for name in names)


class Recorder:
    """Takes the place of a world's physics step and copies what came of each.

    Args:
        world: whose steps are recorded from now on.
        most_ticks: the longest course that there is room for.
    """

    def __init__(self, world: TwinWorld, *, most_ticks: int) -> None:
        self._world, model = world, world.model
        n = most_ticks * world.n_substeps
        self._q, self._qd = np.empty((n, N_JOINTS)), np.empty((n, N_JOINTS))
        self._set_points = np.empty((most_ticks, N_JOINTS))
        self._at_torque = np.empty((n, N_JOINTS), dtype=bool)
        self._most_nm = model.actuator_forcerange[world.joint_controls, 1] * ALL_OF
        self._fingers = np.empty((n, 2))
        self._grip = np.empty(n)
        self._hand_asked = np.empty((most_ticks, 3))
        self._points, self._approach = np.empty((n, 3, 3)), np.empty((n, 3))
        self._twists, self._centre = np.empty((n, 2, 6)), np.empty((n, 3))
        self._stopping = np.empty(n, dtype=bool)
        self._placed = np.empty((most_ticks, model.ngeom, 3))
        self._turned = np.empty((most_ticks, model.ngeom, 9))
        self._kinds = part_kinds(world)
        self._is_own = np.array([k in OWN for k in self._kinds])
        self._body_names = [model.body(int(b)).name for b in model.geom_bodyid]
        self._n = self._n_ticks = 0
        self._touches: list[Touch] = []
        self._wrench = np.zeros(6)
        self._views(world)
        world.step_physics = self._step

    def _views(self, world: TwinWorld) -> None:
        model, data = world.model, world.data
        left, right = world.finger_addresses
        self._finger_at = slice(left, right + 1)
        self._tcp, self._flange = (data.site_xpos[model.site(s).id] for s in ("tcp", "flange"))
        forearm = model.body("link_3").id
        self._forearm, self._forearm_frame = data.xpos[forearm], data.xmat[forearm].reshape(3, 3)
        self._elbow_offset = elbow_offset(model)
        self._tool_frame = data.site_xmat[model.site("tcp").id].reshape(3, 3)
        self._tool_twist, self._elbow_twist = (data.cvel[model.body(b).id] for b in ("tool", "link_3"))
        self._com = data.subtree_com[int(model.body_rootid[model.body("tool").id])]

    def clear(self) -> None:
        """Forget what was recorded."""
        self._n = self._n_ticks = 0
        self._touches = []

    @property
    def n_ticks(self) -> int:
        """Ticks recorded."""
        return self._n_ticks

    def course(self) -> Course:
        """Return what was recorded since `clear`. Its arrays are views that the next stream overwrites."""
        n, ticks = self._n, self._n_ticks
        points = self._points[:n]
        return Course(
            physics_s=float(self._world.model.opt.timestep), n_substeps=self._world.n_substeps,
            q_rad=self._q[:n], qd_rad_s=self._qd[:n], set_point_rad=self._set_points[:ticks],
            at_torque=self._at_torque[:n],
            opening_m=self._fingers[:n].sum(axis=1),
            grip_force_n=np.abs(self._grip[:n]), hand_asked=self._hand_asked[:ticks],
            position_m=points, speed_m_s=_speeds(points, self._twists[:n], self._centre[:n]),
            approach=self._approach[:n], placed=Placed(at_m=self._placed[:ticks], turned=self._turned[:ticks]),
            touches=tuple(self._touches), stopping=self._stopping[:n],
        )  # fmt: skip

    def _step(self, model: mujoco.MjModel, data: mujoco.MjData, nstep: int) -> None:
        self._copy_asked(model)
        for _ in range(nstep):
            mujoco.mj_step(model, data)
            self._copy(data)
            if data.ncon:
                self._note_touches(model, data)
            self._n += 1
        self._set_points[self._n_ticks] = data.ctrl[self._world.joint_controls]
        self._placed[self._n_ticks] = data.geom_xpos
        self._turned[self._n_ticks] = data.geom_xmat
        self._n_ticks += 1

    def _copy(self, data: mujoco.MjData) -> None:
        k = self._n
        self._q[k], self._qd[k] = data.qpos[:N_JOINTS], data.qvel[:N_JOINTS]
        self._fingers[k] = data.qpos[self._finger_at]
        self._grip[k] = data.actuator_force[self._world.grip_control]
        self._at_torque[k] = np.abs(data.actuator_force[self._world.joint_controls]) >= self._most_nm
        elbow = self._forearm + self._forearm_frame @ self._elbow_offset
        self._points[k, 0], self._points[k, 1], self._points[k, 2] = self._tcp, self._flange, elbow
        self._approach[k] = self._tool_frame[:, 2]
        self._twists[k, 0], self._twists[k, 1], self._centre[k] = self._tool_twist, self._elbow_twist, self._com
        self._stopping[k] = self._world.stop_speed_rad_s is not None

    def _copy_asked(self, model: mujoco.MjModel) -> None:
        world, asked = self._world, self._hand_asked[self._n_ticks]
        is_at_rest = abs(world.opening_asked_m - world.opening_goal_m) < TINY_M
        asked[0], asked[1] = world.opening_asked_m, model.actuator_forcerange[world.grip_control, 1]
        asked[2] = np.nan if is_at_rest else world.grip_speed_m_s

    def _note_touches(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        pairs = data.contact.geom
        own = self._is_own[pairs]
        mixed = own.any(axis=1)
        if not mixed.any():
            return
        pressed: dict[tuple[PartKind, PartKind, str], Array] = {}
        for i in np.flatnonzero(mixed).tolist():
            (a, b), sign = pairs[i].tolist(), -1.0
            if not own[i, 0]:
                a, b, sign = b, a, 1.0
            mujoco.mj_contactForce(model, data, i, self._wrench)
            key = (self._kinds[a], self._kinds[b], self._body_names[b])
            vector = sign * self._wrench[:3] @ data.contact.frame[i].reshape(3, 3)  # from the first geom on the second
            pressed.setdefault(key, np.zeros(4))[:] += (self._wrench[0], *vector)
        for key, (force, x, y, z) in pressed.items():
            self._touches.append(Touch(self._n, *key, float(force), (float(x), float(y), float(z))))


def _speeds(points: Array, twists: Array, centre: Array) -> Array:
    """Return the speeds of points of two bodies, whose velocities MuJoCo gives at the tree's centre of mass.

    Args:
        points: (n, 3, 3) tcp, flange, elbow.
        twists: (n, 2, 6) of tool and forearm, angular part first.
        centre: (n, 3) where the linear parts are taken.

    Returns:
        (n, 3)
    """
    of_body = twists[:, (0, 0, 1)]  # (n, 3, 6)
    velocity = of_body[..., 3:] + np.cross(of_body[..., :3], points - centre[:, None])
    return np.linalg.norm(velocity, axis=2)
