"""A world of arithmetic: joints trail their targets, the hand opens and shuts, inputs are what a test sets.

It stands in for a plant wherever physics does not matter. It passes the same contract as every other plant.
"""

import math
from collections.abc import Mapping

import numpy as np

from config.arm import ArmConfig
from config.cell import CellConfig
from config.rig import Rig
from config.scenario import Scenario
from robot.chain import ToolChain
from robot.clock import LockStepClock
from robot.errors import NotEngagedError, StaleStateError
from robot.hal.protocols import Camera, Clock
from robot.kinematics import Kinematics
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
from robot.servo import lag_s

__all__ = ["FakeArm", "FakePlant"]

N_BITS = 16
N_JOINTS = 6
STILL_M = 1e-6
UPRIGHT: Quat = (1.0, 0.0, 0.0, 0.0)


class FakeArm:
    """Six first-order joints and a hand. What a test may set is public.

    Attributes:
        digital_in: Inputs as read.
        force_n: Force on the tool as read.
        held_opening_m: Opening at which the jaws meet something, None where nothing lies between them.
        mode: What the arm says of itself.
        is_silent: No state comes any more.
        n_stops: How often it was stopped.
        n_engaged: How often command was taken.
        n_commands: How many commands it was sent.
    """

    def __init__(self, *, arm: ArmConfig, tick_s: float) -> None:
        joints, servo = arm.joints, arm.servo
        self.spec = ArmSpec(
            model=arm.name,
            rate_hz=1.0 / tick_s,
            n_inputs=N_BITS,
            n_outputs=N_BITS,
            q_min_rad=_vec6([j.range_rad[0] for j in joints]),
            q_max_rad=_vec6([j.range_rad[1] for j in joints]),
            qd_max_rad_s=_vec6([j.speed_rad_s for j in joints]),
            grip_stroke_m=arm.tool.stroke_m,
        )
        self.clock: Clock = LockStepClock(tick_s=tick_s, advance=self._advance)
        self._arm, self._tick_s = arm, tick_s
        self._chain = ToolChain(arm)
        lag = lag_s(lookahead_s=servo.lookahead_s, gain=servo.gain, dead_time_s=servo.dead_time_s)
        self._share = 1.0 - math.exp(-tick_s / max(lag - tick_s / 2, 1e-9))  # a held set-point adds half a tick
        self._is_connected = False
        self.digital_in = 0
        self.force_n: Vec3 = (0.0, 0.0, 0.0)
        self.tcp_speed_m_s: Vec3 | None = None
        """What it says of its tool's speed in place of the truth."""
        self.held_opening_m: float | None = None
        self.mode = ArmMode.RUNNING
        self.is_silent = False
        self.n_stops = 0
        self.n_engaged = 0
        self.n_commands = 0
        self.put(arm.home_rad, digital_out=0)

    def put(self, q_rad: Vec6, *, digital_out: int) -> None:
        """Be somewhere at rest, hand open (a reset)."""
        self._q, self._target = list(q_rad), list(q_rad)
        self._qd = [0.0] * N_JOINTS
        self._opening_m = self._opening_goal_m = self._arm.tool.stroke_m
        self._opening_before_m = self._opening_m
        self._grip_step_m = self._arm.tool.speed_m_s[1] * self._tick_s
        self._digital_out = digital_out
        self.held_opening_m = None

    def connect(self) -> None:
        """Acquire the arm; nothing moves."""
        self._is_connected = True

    def engage(self) -> None:
        """Take command."""
        self.n_engaged += 1

    def read(self) -> ArmState:
        """Return the state after the last tick."""
        if not self._is_connected:
            raise StaleStateError("fake arm: expected connect() before read(); nothing was read")
        if self.is_silent:
            raise StaleStateError("fake arm: expected a state each tick, none came; it was silenced")
        q = _vec6(self._q)
        return ArmState(
            stamp_ns=self.clock.now_ns(),
            q_rad=q,
            qd_rad_s=_vec6(self._qd),
            tcp_position_m=self._chain.tcp(q),
            tcp_quat=self._chain.quat(q),
            tcp_speed_m_s=self.tcp_speed_m_s if self.tcp_speed_m_s is not None else self._tcp_speed(),
            tcp_force_n=self.force_n,
            grip=GripState(
                opening_m=self._opening_m,
                is_moving=abs(self._opening_m - self._opening_before_m) > STILL_M,
                has_object=self._has_object,
            ),
            digital_in=self.digital_in,
            digital_out=self._digital_out,
            mode=self.mode,
        )

    def _tcp_speed(self) -> Vec3:
        """Return how the tool has moved in the last tick."""
        before = _vec6([q - self._tick_s * v for q, v in zip(self._q, self._qd, strict=True)])
        (x1, y1, z1), (x0, y0, z0) = self._chain.tcp(_vec6(self._q)), self._chain.tcp(before)
        return (x1 - x0) / self._tick_s, (y1 - y0) / self._tick_s, (z1 - z0) / self._tick_s

    @property
    def _has_object(self) -> bool:
        held = self.held_opening_m
        return held is not None and self._opening_goal_m < held and self._opening_m <= held

    def write(self, command: ArmCommand) -> None:
        """Take targets for joints, hand and outputs."""
        if not self._is_connected:
            raise NotEngagedError("fake arm: expected connect() before write(); nothing moved")
        self.n_commands += 1
        self._target = list(command.q_rad)
        self._opening_goal_m = command.grip.opening_m
        self._grip_step_m = command.grip.speed_m_s * self._tick_s
        self._digital_out = command.digital_out

    def stop(self) -> bool:
        """Hold where the arm is; fingers that hold nothing stand."""
        self._target = list(self._q)
        if not self._has_object:
            self._opening_goal_m = self._opening_m
        self.n_stops += 1
        return True

    def close(self) -> None:
        """Release the arm."""
        self._is_connected = False

    def _advance(self) -> None:
        for i in range(N_JOINTS):
            change = (self._target[i] - self._q[i]) * self._share
            self._q[i] += change
            self._qd[i] = change / self._tick_s
        self._opening_before_m = self._opening_m
        goal = self._opening_goal_m
        if self.held_opening_m is not None:
            goal = max(goal, min(self.held_opening_m, self._opening_m))
        self._opening_m += min(max(goal - self._opening_m, -self._grip_step_m), self._grip_step_m)


class FakeTruth:
    """Poses of everything the scenario names; a test may move them."""

    def __init__(self, *, scenario: Scenario, clock: Clock) -> None:
        self._clock = clock
        self._positions: dict[str, Vec3] = {}
        self._scenario = scenario
        self.put(np.random.default_rng(0))

    def put(self, rng: np.random.Generator) -> None:
        """Draw every position from its region (a reset)."""
        scenario, places = self._scenario, self._positions
        table_m = scenario.table.height_m
        for button in scenario.buttons:
            places[button.name] = (*_around(button.position_m, button.spread_m, rng), table_m + button.height_m)
        for box in scenario.boxes:
            places[box.name] = (*_around(box.position_m, box.spread_m, rng), table_m)
        for cylinder in scenario.cylinders:
            x, y = _around(cylinder.position_m, cylinder.spread_m, rng)
            if cylinder.inside is not None:
                x, y = x + places[cylinder.inside][0], y + places[cylinder.inside][1]
            places[cylinder.name] = (x, y, table_m + cylinder.height_m / 2)

    def move(self, name: str, position_m: Vec3) -> None:
        """Put one thing somewhere else."""
        if name not in self._positions:
            raise KeyError(f"expected one of {list(self._positions)}, came {name}")
        self._positions[name] = position_m

    def read(self) -> SceneState:
        """Return poses in the scenario's order: buttons, boxes, cylinders."""
        things = tuple(ObjectPose(name=n, position_m=p, quat=UPRIGHT) for n, p in self._positions.items())
        return SceneState(stamp_ns=self._clock.now_ns(), objects=things)


class FakeResetter:
    """Draws the table and the start anew. The same seed and epoch are the same table."""

    def __init__(self, *, arm: FakeArm, truth: FakeTruth, scenario: Scenario, config: ArmConfig) -> None:
        self._arm, self._truth, self._scenario = arm, truth, scenario
        self._home_rad = config.home_rad
        self._kinematics = Kinematics(config)

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Lay the table out for an epoch."""
        rng = np.random.default_rng([seed, epoch])
        self._truth.put(rng)
        start = self._scenario.start
        x, y, z = (rng.uniform(-1.0, 1.0, 3) * start.spread_m + start.position_m).tolist()
        self._arm.put(self._kinematics.solve((x, y, z), self._home_rad), digital_out=digital_out)
        self._arm.digital_in = 0
        self._arm.force_n = (0.0, 0.0, 0.0)


class FakePlant:
    """A plant for tests of everything above it."""

    def __init__(self, *, arm: ArmConfig, scenario: Scenario, rig: Rig, cell: CellConfig | None = None) -> None:
        del cell  # signals are the table's own here: there are no terminals between
        self.identity = PlantIdentity(kind=PlantKind.FAKE, model=arm.name, serial="fake")
        self.arm = FakeArm(arm=arm, tick_s=rig.tick_s)
        self.cameras: Mapping[str, Camera] = {}
        self.truth = FakeTruth(scenario=scenario, clock=self.arm.clock)
        self.resetter = FakeResetter(arm=self.arm, truth=self.truth, scenario=scenario, config=arm)


def _around(centre: tuple[float, float], spread: tuple[float, float], rng: np.random.Generator) -> tuple[float, float]:
    x, y = (rng.uniform(-1.0, 1.0, 2) * spread + centre).tolist()
    return x, y


def _vec6(x: list[float]) -> Vec6:
    return x[0], x[1], x[2], x[3], x[4], x[5]
