"""A twin that a driver's intents are tried on before they are sent: the whole stack, motion and gate, in lock-step."""

import msgspec

from config.loader import load_rig
from config.resolved import Resolved
from robot.messages import ArmState, Intent, ObjectPose, Outcome, Percept, StationMode, Verdict
from robot.rigs import build_station
from sim_twin.as_seen import AsSeen, Beginning
from sim_twin.operator import SimulatedOperator
from sim_twin.plant import TwinPlant

__all__ = ["TwinShadow", "mirrored"]

MOST_LATCHES = 10_000
"""A shadow's latch stops nothing and fails no run."""


def mirrored(resolved: Resolved) -> Resolved:
    """Return the twin's own rig in place of another, in lock-step, with that one's arm, limits, profile and table."""
    rig = msgspec.structs.replace(
        load_rig("twin"), arm=resolved.rig.arm, limits=resolved.rig.limits, profile=resolved.rig.profile,
        max_latches=MOST_LATCHES,
    )  # fmt: skip
    return msgspec.structs.replace(resolved, rig=rig, cell=None)


class TwinShadow:
    """Implements robot.teleop.preview.Shadow.

    Args:
        resolved: what the driver drives; arm, limits, profile and table are the shadow's too.
    """

    def __init__(self, resolved: Resolved) -> None:
        mirror = mirrored(resolved)
        plant = TwinPlant(arm=mirror.arm, scenario=mirror.scenario, rig=mirror.rig)
        self._table = AsSeen(plant.world)
        plant.resetter = self._table
        self._station = build_station(mirror, plant=plant)
        self._operator = SimulatedOperator()

    def begin(self, measured: ArmState, percept: Percept) -> None:
        """Be, at rest, where the arm is and where things are perceived."""
        self._table.take(
            Beginning(
                q_rad=measured.q_rad,
                tcp_m=measured.tcp_position_m,
                digital_out=measured.digital_out,
                opening_m=measured.grip.opening_m,
                has_object=measured.grip.has_object,
                things=tuple(ObjectPose(name=t.name, position_m=t.position_m, quat=t.quat) for t in percept.objects),
            )
        )
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
