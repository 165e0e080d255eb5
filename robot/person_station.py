"""A station whose table a person lays out: the arm parks before, and goes to the drawn start after, slowly."""

import math
from collections.abc import Callable

from robot.errors import SafetyError
from robot.local_station import LocalStation
from robot.messages import Heading, Hold, Intent, JointTarget, Percept, StepResult, Vec3, Vec6
from robot.person_reset import PersonResetter

__all__ = ["PersonResetStation"]

SLOW_RAD_S, SLOW_M_S = 0.2, 0.1
"""What joints on the way to where the arm waits, and the tool on the way up and to the start, are asked for at most.
Whoever lays the table out sits beside it. What sets out and stops anew each time step goes half as fast again."""
EASE = 0.2
"""Share of the way left that is asked for in one time step: asked for all of it, a tool that lags swings to and fro."""
NEAR_M, NEAR_RAD, STILL_RAD_S = 0.003, 0.01, 0.02
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
        """Come to rest, rise, and go to where the arm waits."""
        self._come_to_rest()
        top_m = self.spec.heights_m[1]
        state = self._rise(top_m)
        step_rad = SLOW_RAD_S * self.spec.step_s
        farthest = max(abs(b - a) for a, b in zip(state, self._parked_rad, strict=True))
        n_steps = max(1, math.ceil(farthest / step_rad))
        for k in range(1, n_steps + 1):
            self._carry_out(JointTarget(q_rad=_between(state, self._parked_rad, k / n_steps)))
        self._wait_for(self._parked_rad)

    def _come_to_rest(self) -> None:
        for _ in range(self._most_steps):
            self._carry_out(Hold())
            if max(abs(v) for v in self._measured.qd_rad_s) < STILL_RAD_S:
                return

    def _rise(self, height_m: float) -> Vec6:
        """Go straight up and return the joints there."""
        for _ in range(self._most_steps):
            x, y, z = self._measured.tcp_position_m
            percept = self._step_towards((x, y, height_m + self.spec.table_height_m), (x, y, z), is_straight_up=True)
            if percept.tcp_position_m[2] - self.spec.table_height_m > height_m - NEAR_M:
                break
        return self._measured.q_rad

    def _wait_for(self, q_rad: Vec6) -> None:
        for _ in range(self._most_steps):
            self._carry_out(JointTarget(q_rad=q_rad))
            if max(abs(b - a) for a, b in zip(self._measured.q_rad, q_rad, strict=True)) < NEAR_RAD:
                return
        raise SafetyError("parking: expected the arm parked within a minute, it is not: is something in its way?")

    def _go_to(self, place_m: Vec3, percept: Percept) -> Percept:
        """Go to a place, as high as intents may ask for."""
        lowest_m, top_m = self.spec.heights_m
        height_m = min(max(place_m[2] - self.spec.table_height_m, lowest_m), top_m)
        there_m = (place_m[0], place_m[1], height_m + self.spec.table_height_m)
        for _ in range(self._most_steps):
            if math.dist(percept.tcp_position_m, there_m) < NEAR_M:
                return percept
            percept = self._step_towards(there_m, percept.tcp_position_m)
        raise SafetyError("start: expected the tool at the drawn start within a minute, it is not: look what holds it")

    def _step_towards(self, there_m: Vec3, here_m: Vec3, *, is_straight_up: bool = False) -> Percept:
        """Ask for one slow step towards a place; in height for two, for that is told outright and not by how much."""
        x, y, z = (b - a for a, b in zip(here_m, there_m, strict=True))
        most_m = min(SLOW_M_S * self.spec.step_s, self.spec.max_step_m)
        distance_m = 0.0 if is_straight_up else min(EASE * math.hypot(x, y), most_m)
        height_m = here_m[2] + min(max(z, -2 * most_m), 2 * most_m) - self.spec.table_height_m
        lowest_m, top_m = self.spec.heights_m
        intent = Heading(
            heading_rad=math.atan2(y, x), distance_m=distance_m, height_m=min(max(height_m, lowest_m), top_m)
        )
        return self._carry_out(intent).percept

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
