"""A table without physics: the station's motion, contacts and reflexes as arithmetic, thousands of time steps a second.

It stands in for the twin where a learner is tested. The geometry is the scenario file's; what pushes back is a map of
the lowest height the tool may have over each place.
"""

import math

import numpy as np

from config.loader import load_arm
from config.scenario import Box, Cylinder, GoalKind, Scenario
from robot.messages import (
    Executed,
    GripState,
    Heading,
    Intent,
    ObjectPercept,
    Percept,
    StationMode,
    StationSpec,
    StationState,
    StepResult,
    Vec3,
)
from robot.motion.target import TargetLimits, advance_heading, fence

__all__ = ["KinematicTable"]

STEP_S = 0.05
LAG = 0.4
"""Share of the way to the target that the tool goes in a time step: a lag of 1.5 steps."""
TIP_M = 0.015
PRESS_RADIUS_M, PRESS_TRAVEL_M = 0.045, 0.005
GRASP_X_M, GRASP_Y_M, GRASP_HEIGHT_M = 0.010, 0.017, 0.037
RELEASE_HEIGHT_M = 0.085
"""A hand this low over its object's receptacle lets go."""
BOX_FREE_M = 0.03
"""How far the hand may be from a box's centre before a wall stops it."""
PAD_X_M, PAD_Y_M = 0.033, 0.045
"""Half extents of the place over a standing cylinder where a finger would land on it."""
ORIENTATION = (1.0, 0.0, 0.0, 0.0)
OPENING_M, CLOSED_M = 0.085, 0.044


class KinematicTable:
    """Implements robot.station.Station by arithmetic alone."""

    def __init__(self, scenario: Scenario, *, column_order: tuple[int, ...] | None = None) -> None:
        order = column_order or tuple(range(len(scenario.distances)))
        self.scenario = scenario
        self._limits = TargetLimits.of(load_arm("ur5e"), scenario.table.height_m)
        self.names = tuple(scenario.distances[i] for i in order)
        self.shut: set[str] = set()
        """Boxes whose lids are shut; set by a test."""
        self.is_void = False
        self._boxes = {box.name: box for box in scenario.boxes}
        self._cylinders = {cylinder.name: cylinder for cylinder in scenario.cylinders}
        self._place: dict[str, np.ndarray] = {}
        self._stamp_ns = 0
        self._lifted = False
        self.held: str | None = None
        self.pressed: set[str] = set()
        self.tcp = np.zeros(3)
        self.target = np.zeros(3)
        self._in_contact = False

    # ------------------------------------------------------------------------------------------------------ station

    @property
    def spec(self) -> StationSpec:
        """What may be known before the first step."""
        return StationSpec(
            n_distances=len(self.names),
            n_buttons=len(self.scenario.buttons),
            distance_names=self.names,
            step_s=STEP_S,
            max_step_m=self._limits.max_step_m,
            heights_m=self._limits.heights_m,
            workspace_m=self._limits.workspace_m,
        )

    @property
    def state(self) -> StationState:
        """Always engaged."""
        return StationState(mode=StationMode.ENGAGED)

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Draw the places of things and the start pose."""
        rng = np.random.default_rng((seed, epoch))
        scenario = self.scenario
        self._place = {}
        for thing, height in [(b, b.height_m) for b in scenario.buttons] + [
            (b, b.height_m / 2) for b in scenario.boxes
        ]:
            self._place[thing.name] = _drawn(rng, thing.position_m, thing.spread_m, height)
        for cylinder in scenario.cylinders:
            place = _drawn(rng, cylinder.position_m, cylinder.spread_m, cylinder.height_m / 2)
            if cylinder.inside is not None:
                place[:2] += self._place[cylinder.inside][:2]
            self._place[cylinder.name] = place
        spread = np.array(scenario.start.spread_m)
        self.tcp = np.array(scenario.start.position_m) + rng.uniform(-1.0, 1.0, 3) * spread
        self.target = self.tcp.copy()
        self.held, self.pressed, self._lifted, self._in_contact = None, set(), False, False
        return self._percept()

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        """Move the shaped target, let the tool follow, and let buttons, walls and reflexes act."""
        assert isinstance(intent, Heading)
        before = self.tcp.copy()
        limiters = self._shape(intent)
        self._follow()
        self._press()
        self._reflexes()
        self._stamp_ns += round(STEP_S * 1e9)
        executed = Executed(
            duration_s=STEP_S, moved_m=_vec3(self.tcp - before), target_m=_vec3(self.target), limiters=limiters
        )
        return StepResult(percept=self._percept(), executed=executed, verdicts=(), is_void=self.is_void)

    def close(self) -> None:
        """Nothing to release."""

    # ------------------------------------------------------------------------------------------------------- judging

    def achieved(self) -> tuple[bool, ...]:
        """Return which goals hold now."""
        return tuple(self._holds(goal.kind, goal.object, goal.box) for goal in self.scenario.goals)

    def _holds(self, kind: GoalKind, name: str, box: str | None) -> bool:
        if kind is GoalKind.PRESSED:
            return name in self.pressed
        if kind is GoalKind.GRABBED:
            return self.held == name
        assert box is not None
        return self.held != name and self._is_in(name, self._boxes[box])

    def hold(self, name: str) -> None:
        """Put the tool where it holds a cylinder, as if it had just been grasped."""
        self.tcp = self._place[name] + (0.0, 0.0, 0.0)
        self.target = self.tcp.copy()
        self.held = name

    def is_at_place(self, goal: int) -> bool:
        """Whether the tool is over a goal's place as low as a shut lid lets it."""
        named = self.scenario.goals[goal]
        place = self._place[named.box or named.object]
        return bool(np.hypot(*(self.tcp[:2] - place[:2])) < 0.02 and self._in_contact and self.held is None)

    def best_n_steps(self, goal: int) -> float:
        """Return the fewest time steps in which the goal can be reached from here, in a straight line and a descent."""
        named = self.scenario.goals[goal]
        place, radius, low = self._place[named.box or named.object], 0.01, GRASP_HEIGHT_M
        if named.kind is GoalKind.PRESSED:
            radius, low = PRESS_RADIUS_M, place[2] + TIP_M - PRESS_TRAVEL_M
        elif named.kind is GoalKind.IN_BOX:
            radius, low = BOX_FREE_M, RELEASE_HEIGHT_M
        across = max(0.0, float(np.hypot(*(self.tcp[:2] - place[:2]))) - radius)
        guard, fast, slow = self._limits.guard_z_m, self._limits.max_step_m, self._limits.guarded_speed_m_s * STEP_S
        height = float(self.tcp[2])
        up = max(0.0, guard - height) / fast if across > 0.0 else 0.0
        level = guard if across > 0.0 else min(height, guard)
        over = math.hypot(across, max(0.0, height - guard)) / fast
        return max(1.0, up + over + (level - low) / slow + 1.5)

    # -------------------------------------------------------------------------------------------------------- motion

    def _shape(self, intent: Heading) -> tuple[str, ...]:
        """Move the target as asked, as far as step, guard, workspace and leash allow."""
        moved = advance_heading(_vec3(self.target), intent, self._limits, STEP_S)
        kept = fence(moved.position_m, _vec3(self.tcp), self._limits)
        self.target = np.array(kept.position_m)
        return moved.limiters + kept.limiters

    def _follow(self) -> None:
        """Move the tool towards the target until something stops it."""
        goal = self.tcp + LAG * (self.target - self.tcp)
        self._in_contact = False
        if self._floor(goal[:2]) > max(self.tcp[2], goal[2]) + 1e-9:
            goal[:2] = self.tcp[:2]  # a wall: no way sideways
        floor = self._floor(goal[:2])
        if goal[2] < floor:
            goal[2] = floor
            self.target[2] = floor
            self._in_contact = True
        self.tcp = goal

    def _floor(self, place: np.ndarray) -> float:
        """Return the least height of the tool centre point over a place."""
        floor = 0.019
        for button in self.scenario.buttons:
            if np.hypot(*(place - self._place[button.name][:2])) < button.diameter_m / 2 + 0.01:
                floor = max(floor, button.height_m + TIP_M - button.travel_m)
        for box in self.scenario.boxes:
            floor = max(floor, self._box_floor(place, box))
        for name in self._cylinders:
            floor = max(floor, self._cylinder_floor(place, name))
        return floor

    def _box_floor(self, place: np.ndarray, box: Box) -> float:
        off = np.abs(place - self._place[box.name][:2])
        if (off > np.array(box.inner_m) / 2 + 0.05).any():
            return 0.0
        return 0.02 if (off < BOX_FREE_M).all() and box.name not in self.shut else box.height_m + TIP_M

    def _cylinder_floor(self, place: np.ndarray, name: str) -> float:
        off = np.abs(place - self._place[name][:2])
        if name == self.held or off[0] > PAD_X_M or off[1] > PAD_Y_M:
            return 0.0
        return 0.02 if off[1] < GRASP_Y_M + 0.003 else self._cylinders[name].height_m + TIP_M

    def _press(self) -> None:
        for button in self.scenario.buttons:
            place = self._place[button.name]
            is_over = np.hypot(*(self.tcp[:2] - place[:2])) < PRESS_RADIUS_M
            if is_over and self.tcp[2] <= button.height_m + TIP_M - PRESS_TRAVEL_M:
                self.pressed.add(button.name)

    # ------------------------------------------------------------------------------------------------------ reflexes

    def _reflexes(self) -> None:
        if self.held is None:
            self._close_on_object()
            return
        self._place[self.held] = self.tcp.copy()
        cylinder = self._cylinders[self.held]
        self._lifted = self._lifted or self.tcp[2] > GRASP_HEIGHT_M + self.scenario.reflexes.lift_m
        box = self._boxes.get(cylinder.receptacle or "")
        is_low = self.tcp[2] <= GRASP_HEIGHT_M
        is_boxed = any(self._is_in(cylinder.name, each) for each in self._boxes.values())
        is_received = box is not None and self._is_in(cylinder.name, box) and box.name not in self.shut
        if (is_received and self.tcp[2] < RELEASE_HEIGHT_M) or (self._lifted and is_low and not is_boxed):
            self._open(cylinder)

    def _close_on_object(self) -> None:
        for name in self._cylinders:
            off = np.abs(self.tcp[:2] - self._place[name][:2])
            if off[0] < GRASP_X_M and off[1] < GRASP_Y_M and self.tcp[2] <= GRASP_HEIGHT_M:
                self.held, self._lifted = name, False

    def _open(self, cylinder: Cylinder) -> None:
        self._place[cylinder.name][2] = cylinder.height_m / 2
        self.held = None

    def _is_in(self, name: str, box: Box) -> bool:
        off = np.abs(self._place[name][:2] - self._place[box.name][:2])
        return bool((off < np.array(box.inner_m) / 2).all())

    # ------------------------------------------------------------------------------------------------------- percept

    def _percept(self) -> Percept:
        entries = [self.tcp[2] if n == "table" else math.dist(self.tcp, self._place[n]) for n in self.names]
        lamps = tuple(float(button.name in self.pressed) for button in self.scenario.buttons)
        n = len(entries) + len(lamps)
        return Percept(
            stamp_ns=self._stamp_ns,
            distances_m=tuple(float(d) for d in entries),
            button_states=lamps,
            ages_s=(0.0,) * n,
            valid=(True,) * n,
            objects=tuple(
                ObjectPercept(name=name, position_m=_vec3(at), quat=ORIENTATION, age_s=0.0, is_valid=True)
                for name, at in self._place.items()
            ),
            tcp_position_m=_vec3(self.tcp),
            grip=GripState(
                opening_m=OPENING_M if self.held is None else CLOSED_M,
                is_moving=False,
                has_object=self.held is not None,
            ),
            is_in_contact=self._in_contact,
        )


def _drawn(rng: np.random.Generator, centre: tuple[float, float], spread: tuple[float, float], z: float) -> np.ndarray:
    """Draw a place from a rectangle, at a height."""
    at = np.array(centre) + rng.uniform(-1.0, 1.0, 2) * np.array(spread)
    return np.array([at[0], at[1], z])


def _vec3(values: np.ndarray) -> Vec3:
    """Return an array of three as a tuple."""
    return float(values[0]), float(values[1]), float(values[2])
