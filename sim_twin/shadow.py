"""A twin that a driver's intents are tried on before they are sent: the whole stack, motion and gate, in lock-step."""

import msgspec

from config.loader import load_rig
from config.resolved import Resolved
from robot.layout import Layout, Standing
from robot.messages import ArmState, Intent, Outcome, Percept, StationMode, Verdict
from robot.rigs import build_station
from sim_twin.operator import SimulatedOperator
from sim_twin.plant import TwinPlant, TwinWorld
from sim_twin.posing import pose_world

__all__ = ["TwinShadow"]

MOST_LATCHES = 10_000
"""A shadow's latch stops nothing and fails no run."""


class _AsMeasured:
    """Implements Resetter: the shadow's table is laid out as the other one is."""

    def __init__(self, world: TwinWorld) -> None:
        self._world = world
        self._measured: ArmState
        self._percept: Percept

    def take(self, measured: ArmState, percept: Percept) -> None:
        """Store what the next reset brings about."""
        self._measured, self._percept = measured, percept

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Be where the arm is and where things are perceived; what is held stays held."""
        del seed, epoch, digital_out  # nothing is drawn: outputs are as the other table has them
        world, measured = self._world, self._measured
        things = {thing.name: (thing.position_m, thing.quat) for thing in self._percept.objects}
        fixtures = {f.name: things[f.name][0][:2] for f in (*world.scenario.buttons, *world.scenario.boxes)}
        standing = {c.name: Standing(position_m=things[c.name][0][:2], yaw_rad=0.0) for c in world.scenario.cylinders}
        layout = Layout(fixtures_m=fixtures, cylinders=standing, start_m=measured.tcp_position_m)
        world.put(layout, measured.q_rad, measured.digital_out)
        opening_m = measured.grip.opening_m
        pose_world(world, q_rad=measured.q_rad, opening_m=opening_m, digital_out=measured.digital_out, things=things)
        world.opening_asked_m = world.opening_goal_m = 0.0 if measured.grip.has_object else opening_m
        world.grip_set_point[0] = world.opening_asked_m


class TwinShadow:
    """Implements robot.teleop.preview.Shadow.

    Args:
        resolved: what the driver drives; arm, limits, profile and table are the shadow's too.
    """

    def __init__(self, resolved: Resolved) -> None:
        own = load_rig("twin")
        rig = msgspec.structs.replace(
            own, arm=resolved.rig.arm, limits=resolved.rig.limits, profile=resolved.rig.profile,
            max_latches=MOST_LATCHES,
        )  # fmt: skip
        mirrored = msgspec.structs.replace(resolved, rig=rig, cell=None)
        plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=rig)
        self._table = _AsMeasured(plant.world)
        plant.resetter = self._table
        self._station = build_station(mirrored, plant=plant)
        self._operator = SimulatedOperator()

    def begin(self, measured: ArmState, percept: Percept) -> None:
        """Be, at rest, where the arm is and where things are perceived."""
        self._table.take(measured, percept)
        if self._station.state.mode is StationMode.DISARMED:
            self._operator.arm_once(self._station)
        if self._station.state.mode is StationMode.LATCHED:
            self._operator.rearm(self._station, seed=0, epoch=0)
        self._station.reset(seed=0, epoch=0)

    def attempt(self, intent: Intent, duration_s: float) -> Verdict | None:
        """Carry an intent out and return the verdict that stopped it, None where none did."""
        result = self._station.step(intent, duration_s=duration_s)
        return next((verdict for verdict in result.verdicts if verdict.outcome is Outcome.REFUSED), None)

    def close(self) -> None:
        """Give it back. Idempotent."""
        self._station.close()
