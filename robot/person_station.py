"""A station whose table a person lays out: the arm parks before, and goes to the drawn start after, slowly."""

import math
from collections.abc import Callable

from robot.errors import SafetyError
from robot.local_station import LocalStation
from robot.messages import Heading, Intent, JointTarget, Percept, StepResult, Vec3, Vec6
from robot.person_reset import PersonResetter

__all__ = ["PersonResetStation"]

PARK_RAD_S = 0.3
"""No joint is asked to go faster on the way to where the arm waits."""
NEAR_M, NEAR_RAD = 0.003, 0.01
MOST_S = 60.0


class PersonResetStation(LocalStation):
    """A LocalStation whose resets begin and end with slow moves, through motion and gate like any other.

    Made by robot.node.lab_node; `prepare` tells what a person's reset needs.
    """

    def prepare(
        self, resetter: PersonResetter, parked_rad: Vec6, *, meanwhile: Callable[[], object] = lambda: None
    ) -> None:
        """Store who resets, where the arm waits meanwhile, and what is called before each step of its way."""
        self._by_person, self._parked_rad, self._meanwhile = resetter, parked_rad, meanwhile

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Park, let a person lay the table out, and go to the epoch's start.

        Raises:
            NotEngagedError: the station is not engaged.
            SafetyError: the gate refused the way, or it does not end.
        """
        self._require_command()
        self._park()
        percept = super().reset(seed=seed, epoch=epoch)
        return self._go_to(self._by_person.layout_of(seed=seed, epoch=epoch).start_m, percept)

    def _park(self) -> None:
        """Rise, then go to where the arm waits."""
        top_m = self.spec.heights_m[1]
        state = self._rise(top_m)
        step_rad = PARK_RAD_S * self.spec.step_s
        farthest = max(abs(b - a) for a, b in zip(state, self._parked_rad, strict=True))
        n_steps = max(1, math.ceil(farthest / step_rad))
        for k in range(1, n_steps + 1):
            self._carry_out(JointTarget(q_rad=_between(state, self._parked_rad, k / n_steps)))
        self._wait_for(self._parked_rad)

    def _rise(self, height_m: float) -> Vec6:
        """Go straight up and return the joints there."""
        result = self._carry_out(Heading(heading_rad=0.0, distance_m=0.0, height_m=height_m))
        for _ in range(self._most_steps):
            if result.percept.tcp_position_m[2] - self.spec.table_height_m > height_m - NEAR_M:
                break
            result = self._carry_out(Heading(heading_rad=0.0, distance_m=0.0, height_m=height_m))
        return self._measured.q_rad

    def _wait_for(self, q_rad: Vec6) -> None:
        for _ in range(self._most_steps):
            self._carry_out(JointTarget(q_rad=q_rad))
            if max(abs(b - a) for a, b in zip(self._measured.q_rad, q_rad, strict=True)) < NEAR_RAD:
                return
        raise SafetyError("parking: expected the arm parked within a minute, it is not: is something in its way?")

    def _go_to(self, place_m: Vec3, percept: Percept) -> Percept:
        """Go to a place in straight steps of half the most that a step may have."""
        for _ in range(self._most_steps):
            x, y, z = (b - a for a, b in zip(percept.tcp_position_m, place_m, strict=True))
            if math.hypot(x, y, z) < NEAR_M:
                return percept
            distance_m = min(math.hypot(x, y), self.spec.max_step_m / 2)
            height_m = place_m[2] - self.spec.table_height_m
            intent = Heading(heading_rad=math.atan2(y, x), distance_m=distance_m, height_m=height_m)
            percept = self._carry_out(intent).percept
        raise SafetyError("start: expected the tool at the drawn start within a minute, it is not: look what holds it")

    def _carry_out(self, intent: Intent) -> StepResult:
        self._meanwhile()
        result = self.step(intent)
        if result.verdicts:
            verdict = result.verdicts[0]
            raise SafetyError(f"on the way between parking and table: {verdict.reason}: {verdict.detail}")
        return result

    @property
    def _most_steps(self) -> int:
        return round(MOST_S / self.spec.step_s)


def _between(a: Vec6, b: Vec6, share: float) -> Vec6:
    one, two, three, four, five, six = (p + share * (q - p) for p, q in zip(a, b, strict=True))
    return one, two, three, four, five, six
