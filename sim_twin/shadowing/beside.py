"""The twin beside a plant: the same table and commands, tick by tick, and how far the two are apart. State.

It is told of ticks that were carried out already, so nothing waits for it; when the arm was placed anew, stood still
for others or was not heard of, it begins again where the arm is.
"""

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from config.resolved import Resolved
from robot.messages import ArmCommand, ArmMode, ArmState, ObjectPose, Percept, PlantKind
from sim_twin.as_seen import AsSeen, Beginning
from sim_twin.fitted import joint_servos
from sim_twin.plant import TwinPlant
from sim_twin.shadowing.causes import Cause, Causes

__all__ = ["Apart", "Bounds", "Latched", "TwinBeside"]

Array = NDArray[np.float64]
SETTLE_S = 0.4
"""After a beginning: the twin begins at rest, the arm perhaps not."""
GAP_TICKS, GAP_S = 1.5, 0.2
JUMP_RAD = 0.05
TOUCH_N = 8.0
"""What the tool touches holds the arm: what joints are off says nothing of the arm then."""
GRAVITY_M_S2 = 9.81


class Bounds(msgspec.Struct, frozen=True, kw_only=True):
    """How far the two may be apart, and for how long they may be farther."""

    q_rad: float = 0.03
    tcp_m: float = 0.02
    for_s: float = 0.1
    inputs_s: float = 0.5


class Apart(msgspec.Struct, frozen=True, kw_only=True):
    """How far plant and twin are apart at a tick."""

    stamp_ns: int
    q_rad: tuple[float, ...]
    """Measured less the twin's joints."""
    tcp_m: tuple[float, ...]
    """Likewise, of the tool centre point."""
    inputs: int | None
    """Bits that differ; None where it is not known how the table stands."""
    pull_n: float
    """Upwards force on the tool, measured less the twin's."""


class Latched(msgspec.Struct, frozen=True, kw_only=True):
    """A bound was passed."""

    stamp_ns: int
    what: str
    """`joints`, `tool` or `inputs`."""
    text: str
    causes: tuple[Cause, ...]


class TwinBeside:
    """Takes ticks and compares.

    Args:
        resolved: arm, rig and table; what was fitted of the arm is in its file.
        bounds: that latch.

    Attributes:
        apart: At the newest tick that was compared.
        latched: The first bound that was passed; stays until `release`.
        n_compared: Ticks compared so far.
        n_begun: How often it began anew.
    """

    def __init__(self, resolved: Resolved, *, bounds: Bounds | None = None) -> None:
        rig = resolved.rig
        physics_s = min(rig.physics_s, rig.tick_s)
        timed = msgspec.structs.replace(rig, physics_s=physics_s)
        self._plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=timed)
        self._plant.arm.connect()
        self._table = AsSeen(self._plant.world)
        self._tick_s, self._bounds = rig.tick_s, bounds or Bounds()
        names = [joint.name for joint in resolved.arm.joints]
        servos = joint_servos(resolved.arm, rig.tick_s)
        self._causes = Causes(
            names, [servo.stiffness_nm_rad for servo in servos], tick_s=rig.tick_s,
            servo_s=servos[0].damping_nm_s_rad / servos[0].stiffness_nm_rad,
        )  # fmt: skip
        self._tool = self._plant.world.model.body("tool").id
        self._jacobian = np.zeros((3, self._plant.world.model.nv))
        self._is_of_last_step = rig.expected.kind == PlantKind.TWIN
        """A twin tells its tool where it was at the beginning of its last step of physics; a controller does not."""
        self._things: tuple[ObjectPose, ...] = ()
        self._knows_table = False
        self._command: ArmCommand | None = None
        self._stamp_ns, self._since_s = 0, 0.0
        self._over_s: dict[str, float] = dict.fromkeys(("joints", "tool", "inputs"), 0.0)
        self.apart: Apart | None = None
        self.latched: Latched | None = None
        self.n_compared = self.n_begun = 0

    @property
    def causes(self) -> tuple[Cause, ...]:
        """What the last seconds look like."""
        return self._causes.named()

    def release(self) -> None:
        """Forget what latched."""
        self.latched = None
        self._over_s = dict.fromkeys(self._over_s, 0.0)

    def see(self, percept: Percept) -> None:
        """Take note of how the table stands; it counts at the next beginning, which is now where it was not known."""
        if not all(thing.is_valid for thing in percept.objects):
            return
        self._things = tuple(ObjectPose(name=t.name, position_m=t.position_m, quat=t.quat) for t in percept.objects)
        if not self._knows_table:
            self._command = None

    def begin_anew(self) -> None:
        """Begin where the arm is at the next tick: it or its table was placed."""
        self._command, self._things = None, ()

    def take(self, state: ArmState, command: ArmCommand) -> None:
        """Take a tick: what was measured, and what was sent to the plant then."""
        if state.mode is not ArmMode.RUNNING:
            self._command = None
            return
        if self._command is None or not self._caught_up(state):
            self._begin(state)
        elif self._since_s >= SETTLE_S:
            self._compare(state)
        self._stamp_ns, self._command = state.stamp_ns, command
        self._plant.world.carry_out(command)
        self._advance()

    def _caught_up(self, state: ArmState) -> bool:
        """Let ticks pass of which nothing came; return whether the twin may go on from where it is."""
        gone_s = (state.stamp_ns - self._stamp_ns) * 1e-9
        missing = round(gone_s / self._tick_s) - 1
        if gone_s <= 0.0 or gone_s > GAP_S:
            return False
        for _ in range(missing):
            self._advance()
        off = np.subtract(state.q_rad, self._plant.world.data.qpos[:6])
        return not (self._since_s < SETTLE_S and float(np.abs(off).max()) > JUMP_RAD * 4)

    def _begin(self, state: ArmState) -> None:
        self._table.take(
            Beginning(
                q_rad=state.q_rad, tcp_m=state.tcp_position_m, digital_out=state.digital_out,
                opening_m=state.grip.opening_m, has_object=state.grip.has_object, things=self._things,
            )
        )  # fmt: skip
        self._knows_table = bool(self._things)
        self._table.reset(seed=0, epoch=0, digital_out=state.digital_out)
        self._causes.forget()
        self._since_s = 0.0
        self.n_begun += 1

    def _advance(self) -> None:
        self._plant.arm.clock.wait_tick()
        self._since_s += self._tick_s

    def _compare(self, state: ArmState) -> None:
        world = self._plant.world
        if not self._is_of_last_step:
            mujoco.mj_kinematics(world.model, world.data)
        twin = self._plant.arm.read()
        differ = state.digital_in ^ twin.digital_in if self._knows_table else None
        self.apart = apart = Apart(
            stamp_ns=state.stamp_ns,
            q_rad=tuple(a - b for a, b in zip(state.q_rad, twin.q_rad, strict=True)),
            tcp_m=tuple(a - b for a, b in zip(state.tcp_position_m, twin.tcp_position_m, strict=True)),
            inputs=differ,
            pull_n=state.tcp_force_n[2] - twin.tcp_force_n[2],
        )
        self.n_compared += 1
        if max(map(abs, twin.tcp_force_n)) > TOUCH_N or state.grip.has_object:
            self._causes.forget()
        else:
            lift = self._lift() if self._causes.is_due else None
            self._causes.take(np.array(apart.q_rad), np.array(twin.qd_rad_s), lift)
        self._judge(apart)

    def _lift(self) -> Array:
        world = self._plant.world
        mujoco.mj_jacBodyCom(world.model, world.data, self._jacobian, None, self._tool)
        return self._jacobian[2, :6].copy()

    def _judge(self, apart: Apart) -> None:
        bounds = self._bounds
        joint = max(range(6), key=lambda i: abs(apart.q_rad[i]))
        tool_m = float(np.linalg.norm(apart.tcp_m))
        looks = (
            ("joints", abs(apart.q_rad[joint]) > bounds.q_rad, bounds.for_s,
             f"joint {joint + 1} is {1e3 * apart.q_rad[joint]:+.1f} mrad off its twin, {1e3 * bounds.q_rad:g} allowed"),
            ("tool", tool_m > bounds.tcp_m, bounds.for_s,
             f"the tool is {1e3 * tool_m:.1f} mm off its twin's, {1e3 * bounds.tcp_m:g} allowed"),
            ("inputs", bool(apart.inputs), bounds.inputs_s,
             f"inputs {apart.inputs or 0:#06b} are not as the twin's for {bounds.inputs_s:g} s"),
        )  # fmt: skip
        for what, is_over, for_s, text in looks:
            self._over_s[what] = self._over_s[what] + self._tick_s if is_over else 0.0
            if self.latched is None and self._over_s[what] > for_s:
                self.latched = Latched(stamp_ns=apart.stamp_ns, what=what, text=text, causes=self.causes)
