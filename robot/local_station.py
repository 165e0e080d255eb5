"""A station in one process: plant, perception, cell, reflexes, motion and gate, tick by tick in lock-step."""

from types import TracebackType
from typing import Protocol

import msgspec

from config.arm import ArmConfig
from config.rig import Rig
from config.rules import RuleSet
from config.scenario import Scenario
from robot.cell import Cell
from robot.errors import RobotConfigError, WireError
from robot.hal.protocols import Plant
from robot.kinematics import ToolChain
from robot.messages import (
    ArmCommand,
    ArmState,
    Executed,
    GripCommand,
    Hold,
    Intent,
    Percept,
    PlantIdentity,
    SceneState,
    StationSpec,
    StationState,
    StepResult,
    Verdict,
)
from robot.motion import HandReflexes, Mover
from robot.safety import Arming, Gate, GateLimits, Reason

__all__ = ["LocalStation", "Perceives"]

WHOLE_TICKS = 1e-6
MAX_STEP_S = 10.0
_HOLD = Hold()


class Perceives(Protocol):
    """What the station needs of perception."""

    def perceive(self, arm: ArmState, scene: SceneState | None) -> Percept:
        """Return the percept at the arm's stamp."""
        ...


class LocalStation:
    """Implements robot.station.Station over one plant in this process, and Armable for an operator.

    Each tick: read, cell, motion, gate, wait. The percept is made once, at the end of a step; the hand's reflexes are
    decided once, at its beginning. After arming, a reset or a latch everything starts from the measured state, so that
    an epoch depends on nothing before its reset.
    """

    def __init__(
        self,
        *,
        plant: Plant,
        perception: Perceives,
        arm: ArmConfig,
        scenario: Scenario,
        rule_sets: tuple[RuleSet, ...],
        rig: Rig,
    ) -> None:
        if abs(plant.arm.spec.rate_hz * rig.tick_s - 1.0) > WHOLE_TICKS:
            raise RobotConfigError(
                f"rig {rig.name}: tick {rig.tick_s} s, the plant's is {1 / plant.arm.spec.rate_hz} s"
            )
        table_m = scenario.table.height_m
        self._plant, self._perception, self._rig = plant, perception, rig
        self._cell = Cell(scenario=scenario, rule_sets=rule_sets, arm=arm)
        self._mover = Mover(arm, table_m=table_m, tick_s=rig.tick_s)
        self._reflexes = HandReflexes(arm=arm, scenario=scenario)
        limits = GateLimits.of(arm, plant.arm.spec, table_m=table_m, tick_s=rig.tick_s)
        self._gate = Gate(arm=plant.arm, limits=limits, chain=ToolChain(arm))
        self._arming = Arming(expected=rig.expected, max_latches=rig.max_latches)
        self._spec = StationSpec(
            n_distances=len(scenario.distances),
            n_buttons=len(scenario.buttons),
            distance_names=scenario.distances,
            step_s=arm.motion.step_s,
            max_step_m=arm.motion.max_step_m,
            heights_m=arm.motion.heights_m,
            workspace_m=arm.motion.workspace_m,
            table_height_m=table_m,
        )
        self._tick_ns = round(rig.tick_s * 1e9)
        self._state: ArmState
        self._percept: Percept
        self._is_connected = False

    def __enter__(self) -> "LocalStation":
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def spec(self) -> StationSpec:
        """What may be known before the first step."""
        return self._spec

    @property
    def state(self) -> StationState:
        """Mode and, when latched, why."""
        return self._arming.state

    @property
    def identity(self) -> PlantIdentity:
        """Which world this is."""
        return self._plant.identity

    @property
    def n_latches(self) -> int:
        """How often the station has latched since it was made."""
        return self._arming.n_latches

    def connect(self) -> None:
        """Acquire the plant. Moves nothing. Idempotent."""
        if not self._is_connected:
            self._plant.arm.connect()
            self._is_connected = True

    def arm(self, *, by: str) -> None:
        """Go from disarmed to armed, if this is the plant that the rig names. For an operator."""
        self.connect()
        self._arming.arm(identity=self._plant.identity, by=by)

    def engage(self) -> None:
        """Go from armed to engaged: everything starts from the measured state. For an operator."""
        self._arming.engage()
        self._seed()

    def reset_plant(self, *, seed: int, epoch: int) -> None:
        """Lay the table out in any mode. Clears no latch. For an operator."""
        digital_out = self._cell.begin_epoch(epoch)
        self._plant.resetter.reset(seed=seed, epoch=epoch, digital_out=digital_out)
        self._arming.note_plant_reset()

    def clear_latch(self, *, by: str) -> None:
        """Go from latched to armed, after the plant's reset only. For an operator."""
        self._arming.clear_latch(identity=self._plant.identity, by=by)

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Lay the table out for an epoch and return the first percept.

        Raises:
            NotEngagedError: the station is not engaged; a latch is never cleared here.
        """
        self._arming.require_engaged()
        self.reset_plant(seed=seed, epoch=epoch)
        return self._seed()

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        """Carry out an intent for one time step and return the percept after it.

        Raises:
            NotEngagedError: the station is not engaged.
            RobotConfigError: the duration is not a whole number of ticks from one up.
        """
        self._arming.require_engaged()
        duration = self._spec.step_s if duration_s is None else duration_s
        n_ticks = self._whole_ticks(duration)
        before = self._state
        verdict = self._gate.admit(intent, now_ns=self._plant.arm.clock.now_ns())
        if verdict is not None:
            self._latch(verdict)
            return self._result(before, 0.0, (verdict,))
        grip = self._reflexes.decide(self._percept, intent.grip)
        if self._reflexes.is_busy:
            self._mover.begin_step(_HOLD, before, duration_s=duration)
            self._mover.hold("hand")
        else:
            self._mover.begin_step(intent, before, duration_s=duration)
        for _ in range(n_ticks):
            verdict = self._tick(grip)
            if verdict is not None:
                self._latch(verdict)
                return self._result(before, duration, (verdict,))
        return self._result(before, duration, ())

    def close(self) -> None:
        """Stop and release. Idempotent, never raises."""
        if self._is_connected:
            self._plant.arm.stop()
            self._plant.arm.close()
            self._is_connected = False
        self._arming.disarm()

    def _tick(self, grip: GripCommand) -> Verdict | None:
        """One tick of the loop. Returns the gate's refusal, if it refused."""
        arm, gate = self._plant.arm, self._gate
        now_ns = arm.clock.now_ns()
        try:
            state = self._read(now_ns)
            command = ArmCommand(
                stamp_ns=now_ns,
                sequence=gate.next_sequence,
                q_rad=self._mover.tick(state),
                grip=grip,
                digital_out=self._cell.tick(state),
            )
            verdict = gate.write(command, state, now_ns=now_ns)
            if verdict is None:
                arm.clock.wait_tick()
                self._state = arm.read()
        except WireError as error:
            return gate.latch(Reason.STALE_STATE, str(error), now_ns=now_ns)
        return verdict

    def _read(self, now_ns: int) -> ArmState:
        """Return the newest state; in lock-step the last one still is."""
        if now_ns - self._state.stamp_ns >= self._tick_ns:
            self._state = self._plant.arm.read()
        return self._state

    def _seed(self) -> Percept:
        """Start everything from the measured state."""
        state = self._state = self._plant.arm.read()
        self._gate.seed(state)
        self._mover.seed(state)
        percept = self._perceive(state)
        self._reflexes.reset(percept)
        return percept

    def _perceive(self, state: ArmState) -> Percept:
        truth = self._plant.truth
        percept = self._perception.perceive(state, None if truth is None else truth.read())
        if self._mover.is_in_contact:
            percept = msgspec.structs.replace(percept, is_in_contact=True)
        self._percept = percept
        return percept

    def _result(self, before: ArmState, duration_s: float, verdicts: tuple[Verdict, ...]) -> StepResult:
        after, mover = self._state, self._mover
        (x0, y0, z0), (x1, y1, z1) = before.tcp_position_m, after.tcp_position_m
        limiters = mover.limiters
        is_lost = self._reflexes.lost_object
        return StepResult(
            percept=self._perceive(after),
            executed=Executed(
                duration_s=duration_s,
                moved_m=(x1 - x0, y1 - y0, z1 - z0),
                target_m=mover.target_m,
                limiters=(*limiters, "object_lost") if is_lost else limiters,
            ),
            verdicts=verdicts,
            is_void=is_lost or bool(verdicts),
        )

    def _latch(self, verdict: Verdict) -> None:
        self._arming.latch(f"{verdict.reason}: {verdict.detail}")

    def _whole_ticks(self, duration_s: float) -> int:
        n = round(duration_s / self._rig.tick_s) if 0.0 < duration_s <= MAX_STEP_S else 0
        if n < 1 or abs(n * self._rig.tick_s - duration_s) > WHOLE_TICKS:
            expected = f"whole ticks of {self._rig.tick_s} s up to {MAX_STEP_S} s"
            raise RobotConfigError(f"duration_s: expected {expected}, came {duration_s}")
        return n
