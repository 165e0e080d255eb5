"""The twin: the Plant door in front of MuJoCo, in lock-step."""

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig
from config.cell import CellConfig
from config.rig import Rig
from config.scenario import Scenario
from robot.chain import ToolChain
from robot.clock import LockStepClock
from robot.errors import NotEngagedError, StaleStateError
from robot.hal.protocols import Arm, Camera, Clock, Resetter, SceneTruth
from robot.kinematics import Kinematics
from robot.layout import Layout, draw_layout
from robot.messages import (
    ArmCommand,
    ArmMode,
    ArmSpec,
    ArmState,
    GripState,
    ObjectPose,
    PlantIdentity,
    PlantKind,
    Quat,
    SceneState,
    Vec3,
    Vec6,
)
from sim_twin.fitted import Smoothing, nominal_plant
from sim_twin.names import on_table
from sim_twin.perturbing import moved, perturb_model, perturbed_arm
from sim_twin.plant_reading import Addresses, Fingers, arm_reading
from sim_twin.scene import build_scene
from sim_twin.table import TableDrive

__all__ = ["TwinArm", "TwinPlant", "TwinResetter", "TwinTruth", "TwinWorld"]

Array = NDArray[np.float64]
N_BITS = 16
SETTLE_TICKS = 4
STOP_RAD_S2 = 16.0  # deceleration of a stop; a CB3 UR5 at full speed stops its base in 0.31 rad, 244 ms
HELD_GAP_M = 0.003
STILL_M_S = 0.004


class TwinWorld:
    """Model, data and the table's drives: the one place where physics advances.

    Where the rig says so they differ from the files; `arm` is then the arm as it is.
    """

    def __init__(self, arm: ArmConfig, scenario: Scenario, rig: Rig) -> None:
        by = rig.perturbation
        self.arm = arm = arm if by is None else perturbed_arm(arm, by)
        self.scenario, self.tick_s = scenario, rig.tick_s
        self.model = build_scene(arm, scenario, physics_s=rig.physics_s, tick_s=rig.tick_s).compile()
        if by is not None:
            perturb_model(self.model, by)
        self.model_sha256 = _digest(self.model)
        self.data = mujoco.MjData(self.model)
        self.table = TableDrive(self.model, self.data, scenario, tick_s=rig.tick_s)
        self.n_substeps = round(rig.tick_s / rig.physics_s)
        self.step_physics = mujoco.mj_step  # a bench puts a stopwatch here
        self.after_tick: Callable[[], object] | None = None
        """Called when a tick's physics is done: what looks at the world as it goes by."""
        self.clock = LockStepClock(tick_s=rig.tick_s, advance=self.advance)
        self.digital_out = 0
        self.opening_asked_m = arm.tool.stroke_m
        self.opening_goal_m = arm.tool.stroke_m
        self.grip_speed_m_s = arm.tool.speed_m_s[1]
        self._grip_force_n = arm.tool.grip_force_n
        self.grip_control = self.model.actuator("grip").id
        self.grip_set_point = self.data.ctrl[self.grip_control : self.grip_control + 1]
        self.stop_speed_rad_s: Array | None = None
        self.stop_rad_s2 = STOP_RAD_S2 * (1.0 if by is None else by.braking_factor)
        self.joint_controls = np.array([self.model.actuator(j.name).id for j in arm.joints])
        self._first = int(self.joint_controls[0])
        self.finger_addresses = [int(self.model.joint(f"finger_{s}").qposadr[0]) for s in ("left", "right")]
        smoothing_s = nominal_plant(arm).smoothing_s
        self._smoothing = Smoothing(smoothing_s, rig.physics_s) if smoothing_s else None
        self._joint_targets = np.zeros(6)

    def rest_at(self, q_rad: Sequence[float]) -> None:
        """Let the servos have been asked for these joints for long.  (6,)"""
        self.data.ctrl[self._first : self._first + 6] = q_rad
        self._joint_targets[:] = q_rad
        if self._smoothing is not None:
            self._smoothing.seat(self._joint_targets)

    def carry_out(self, command: ArmCommand) -> None:
        """Let servos, hand and outputs be asked for a command from now on, which some gate has passed."""
        self.aim(command.q_rad)
        grip = command.grip
        self.opening_goal_m = grip.opening_m
        self.grip_speed_m_s = grip.speed_m_s
        self.limit_grip(grip.force_n)
        self.digital_out = command.digital_out

    def aim(self, q_rad: Vec6) -> None:
        """Let the servos be asked for joints from now on, smoothed as this arm does it.  (6,)"""
        if self._smoothing is None:
            self.data.ctrl[self._first : self._first + 6] = q_rad
        else:
            if self.stop_speed_rad_s is not None:
                self._smoothing.seat(self.data.ctrl[self.joint_controls])
            self._joint_targets[:] = q_rad
        self.stop_speed_rad_s = None

    def advance(self) -> None:
        """One tick: drives, then physics."""
        step = self.grip_speed_m_s * self.tick_s
        if self.opening_goal_m > self.opening_asked_m:
            # A hand that squeezed has its set-point far inside the object: it lets go from where the fingers are.
            left, right = self.finger_addresses
            self.opening_asked_m = max(self.opening_asked_m, float(self.data.qpos[left] + self.data.qpos[right]))
        self.opening_asked_m += min(max(self.opening_goal_m - self.opening_asked_m, -step), step)
        self.grip_set_point[0] = self.opening_asked_m
        if self.stop_speed_rad_s is not None:
            self._ramp_down(self.stop_speed_rad_s)
        self.table.drive(self.data, self.digital_out)
        if self._smoothing is not None and self.stop_speed_rad_s is None:
            self._step_smoothed(self._smoothing)
        else:
            self.step_physics(self.model, self.data, self.n_substeps)
        if self.after_tick is not None:
            self.after_tick()

    def _step_smoothed(self, smoothing: Smoothing) -> None:
        set_point = self.data.ctrl[self._first : self._first + 6]
        for _ in range(self.n_substeps):
            set_point[:] = smoothing.step(self._joint_targets)
            self.step_physics(self.model, self.data, 1)

    def limit_grip(self, force_n: float) -> None:
        """Let the hand press with so much at most (N)."""
        if force_n != self._grip_force_n:
            self._grip_force_n = force_n
            self.model.actuator_forcerange[self.grip_control] = (-force_n, force_n)

    def begin_stop(self) -> None:
        """Let the set-points run out at a stop's deceleration from the speed that the joints have now."""
        if self.stop_speed_rad_s is None:
            self.stop_speed_rad_s = self.data.qvel[:6].copy()
            self.data.ctrl[self.joint_controls] = self.data.qpos[:6]

    def _ramp_down(self, speed: Array) -> None:
        # One share for all joints, so that the tool stays on its path while it slows down.
        fastest = float(np.abs(speed).max())
        share = max(0.0, 1.0 - self.stop_rad_s2 * self.tick_s / fastest) if fastest > 0.0 else 0.0
        speed *= share
        self.data.ctrl[self.joint_controls] += speed * self.tick_s

    def put(self, layout: Layout, q_rad: tuple[float, ...], digital_out: int) -> None:
        """Place everything (a reset): the only teleport there is."""
        model, data, tool = self.model, self.data, self.arm.tool
        for name, (x, y) in layout.fixtures_m.items():
            model.body(on_table(name)).pos[:2] = (x, y)
        # With sleeping on, what cannot move is placed by the reset and never again: move fixtures before it.
        mujoco.mj_resetData(model, data)
        self.stop_speed_rad_s = None
        for cylinder in self.scenario.cylinders:
            standing = layout.cylinders[cylinder.name]
            address = int(model.joint(on_table(cylinder.name)).qposadr[0])
            height = self.scenario.table.height_m + cylinder.height_m / 2
            data.qpos[address : address + 3] = (*standing.position_m, height)
            data.qpos[address + 3 : address + 7] = (np.cos(standing.yaw_rad / 2), 0, 0, np.sin(standing.yaw_rad / 2))
        data.qpos[:6] = q_rad
        self.rest_at(q_rad)
        for address in self.finger_addresses:
            data.qpos[address] = tool.stroke_m / 2
        self.opening_asked_m = self.opening_goal_m = tool.stroke_m
        self.grip_speed_m_s = tool.speed_m_s[1]
        self.limit_grip(tool.grip_force_n)
        self.digital_out = digital_out
        self.table.put(data, digital_out)
        mujoco.mj_forward(model, data)
        _fill_history(model, data)


def _fill_history(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Fill the delayed actuators' buffers with the present set-points, so that no zero is ever acted on."""
    for i in range(model.nu):
        n = int(model.actuator_history[i, 0])
        if n:
            times = data.time - model.opt.timestep * np.arange(n, 0, -1)
            mujoco.mj_initCtrlHistory(model, data, i, times, np.full(n, data.ctrl[i]))


class TwinArm:
    """The arm, its hand and its inputs and outputs on the twin."""

    def __init__(self, world: TwinWorld, *, believed: ToolChain | None = None) -> None:
        """Take the arm of a world.

        Args:
            world: that it is in.
            believed: tells the tool's place by the joints, where the controller takes it from its own kinematics; None
                tells it as it is.
        """
        self._world = world
        self._believed = believed
        self.clock: Clock = world.clock
        joints = world.arm.joints
        self.spec = ArmSpec(
            model=world.arm.name,
            rate_hz=1.0 / world.tick_s,
            n_inputs=N_BITS,
            n_outputs=N_BITS,
            q_min_rad=_vec6(j.range_rad[0] for j in joints),
            q_max_rad=_vec6(j.range_rad[1] for j in joints),
            qd_max_rad_s=_vec6(j.speed_rad_s for j in joints),
            grip_stroke_m=world.arm.tool.stroke_m,
        )
        self._is_connected = False
        data, model = world.data, world.model
        tool, fingers = model.body("tool").id, world.finger_addresses
        speeds = [int(model.joint(f"finger_{side}").dofadr[0]) for side in ("left", "right")]
        self._arrays = (
            data.qpos.reshape(1, -1), data.qvel.reshape(1, -1), data.site_xpos, data.xquat, data.cvel,
            data.subtree_com, data.sensordata.reshape(1, -1),
        )  # fmt: skip
        self._addresses: Addresses = (
            tool, int(model.body_rootid[tool]), model.site("tcp").id, int(model.sensor("tool_force").adr[0]),
            fingers[0], fingers[1], speeds[0], speeds[1],
        )  # fmt: skip
        self._has_object = False

    def connect(self) -> None:
        """Take the arm; nothing moves."""
        self._is_connected = True

    def engage(self) -> None:
        """Take command; there is nobody to take it from."""

    def read(self) -> ArmState:
        """Return the state after the last tick."""
        if not self._is_connected:
            raise StaleStateError("twin arm: expected connect() before read(); nothing was read")
        world = self._world
        q, qd, place, turn, speed, pushed, fingers = self._reading()
        if self._believed is not None:
            place = self._believed.tcp(q)
        return ArmState(
            stamp_ns=world.clock.now_ns(),
            q_rad=q,
            qd_rad_s=qd,
            tcp_position_m=place,
            tcp_quat=turn,
            tcp_speed_m_s=speed,
            tcp_force_n=pushed,
            grip=self._grip_of(fingers),
            digital_in=world.table.read_inputs(),
            digital_out=world.digital_out,
            mode=ArmMode.RUNNING,
        )

    def _reading(self) -> tuple[Vec6, Vec6, Vec3, Quat, Vec3, Vec3, Fingers]:
        """Return what the physics says; the tool's velocity is of the beginning of its last step."""
        return arm_reading(*self._arrays, self._addresses)

    def _grip_of(self, fingers: Fingers) -> GripState:
        """Opening from the fingers; an object is what stalls a closing hand before its jaws meet."""
        opening, speed = fingers
        is_still = abs(speed) < STILL_M_S
        is_pressing = opening - self._world.opening_asked_m > HELD_GAP_M and opening > HELD_GAP_M
        # Once held, a short stir of the fingers is not a loss; meeting jaws or an opening hand is.
        self._has_object = is_pressing and (is_still or self._has_object)
        return GripState(opening_m=opening, is_moving=not is_still, has_object=self._has_object)

    def write(self, command: ArmCommand) -> None:
        """Set the servo targets, the hand's target and the outputs for the next tick."""
        if not self._is_connected:
            raise NotEngagedError("twin arm: expected connect() before write(); nothing moved")
        self._world.carry_out(command)

    def stop(self) -> bool:
        """Hold where the arm is; a hand that holds something keeps its force, other fingers stand."""
        world = self._world
        world.begin_stop()
        if not self._grip_of(self._reading()[-1]).has_object:
            world.opening_goal_m = world.opening_asked_m
        return True

    def close(self) -> None:
        """Release the arm."""
        self._is_connected = False


class TwinTruth:
    """Poses of everything the scenario names, straight from the physics, but for how far off it is to tell them."""

    def __init__(self, world: TwinWorld, *, off_m: Vec3 = (0.0, 0.0, 0.0)) -> None:
        self._world = world
        self._off_m = off_m if any(off_m) else None
        scenario, model = world.scenario, world.model
        self._entries = [
            (
                e.name,
                model.body(on_table(e.name)).id,
                model.body(on_table(e.name, "cap")).id if e in scenario.buttons else None,
            )
            for e in (*scenario.buttons, *scenario.boxes, *scenario.cylinders)
        ]

    def read(self) -> SceneState:
        """Return poses in the scenario's order: buttons (their caps), boxes (centre of the floor), cylinders."""
        data = self._world.data
        return SceneState(
            stamp_ns=self._world.clock.now_ns(),
            objects=tuple(
                ObjectPose(
                    name=name,
                    position_m=self._told(_vec3(data.xpos[body if cap is None else cap])),
                    quat=_quat(data.xquat[body]),
                )
                for name, body, cap in self._entries
            ),
        )

    def _told(self, place_m: Vec3) -> Vec3:
        return place_m if self._off_m is None else moved(place_m, self._off_m)


class TwinResetter:
    """Teleports the table to a drawn start. The same seed and epoch are the same table."""

    def __init__(self, world: TwinWorld, kinematics: Kinematics) -> None:
        self._world, self._kinematics = world, kinematics

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Draw and place a layout, put the lids where the outputs say, and let everything settle."""
        world = self._world
        layout = draw_layout(world.scenario, np.random.default_rng([seed, epoch]))
        q_rad = self._kinematics.solve(layout.start_m, world.arm.home_rad)
        world.put(layout, q_rad, digital_out)
        for _ in range(SETTLE_TICKS):
            world.clock.wait_tick()


class TwinPlant:
    """A world in MuJoCo: one arm, one table."""

    def __init__(self, *, arm: ArmConfig, scenario: Scenario, rig: Rig, cell: CellConfig | None = None) -> None:
        del cell  # signals are the table's own here: there are no terminals between
        by = rig.perturbation
        self._world = TwinWorld(arm, scenario, rig)
        self.identity = PlantIdentity(kind=PlantKind.TWIN, model=arm.name, serial="twin")
        believed = ToolChain(arm) if by is not None and by.tells_belief else None
        self.arm: Arm = TwinArm(self._world, believed=believed)
        self.cameras: Mapping[str, Camera] = {}
        self.truth: SceneTruth | None = TwinTruth(self._world, off_m=(0.0, 0.0, 0.0) if by is None else by.percept_m)
        self.resetter: Resetter = TwinResetter(self._world, Kinematics(self._world.arm))
        self._world.put(draw_layout(scenario, np.random.default_rng(0)), arm.home_rad, digital_out=0)

    @property
    def world(self) -> TwinWorld:
        """Model and data, for pictures and benches."""
        return self._world

    @property
    def model_sha256(self) -> str:
        """Digest of the compiled model, before any reset moved a thing: the same files give the same."""
        return self._world.model_sha256


def _digest(model: mujoco.MjModel) -> str:
    buffer = np.zeros(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return hashlib.sha256(buffer.tobytes()).hexdigest()


def _vec6(values: Iterable[float]) -> Vec6:
    a, b, c, d, e, f = values
    return a, b, c, d, e, f


def _vec3(array: np.ndarray) -> Vec3:
    x, y, z = array.tolist()
    return x, y, z


def _quat(array: np.ndarray) -> Quat:
    w, x, y, z = array.tolist()
    return w, x, y, z
