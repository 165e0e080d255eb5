"""The percept of a perception node, for a robot node that holds the arm. State.

A measurement is told, and the percept at its stamp waited for a little. Where none comes in time the newest one serves,
completed with what the arm knows by itself, under its own stamp: how old it is, is judged by who moves. One that is too
old is none.
"""

import math
from collections.abc import Callable, Mapping
from threading import Condition
from time import monotonic_ns

import msgspec

from config.scenario import Scenario
from robot.bus.camera_rows import Forget
from robot.bus.errors import BusError
from robot.bus.inlet import Received
from robot.bus.session import Bus
from robot.bus.topics import FORGET, PERCEPT
from robot.errors import StaleStateError
from robot.hal.protocols import Camera
from robot.messages import ArmState, Percept, SceneState, Vec3

__all__ = ["RemotePerception"]

ANSWER_S, AGAIN_S = 0.015, 0.05
FIRST_S, N_FIRST = 5.0, 3
"""How long a perception node may be away while the arm rests, and how many percepts tell of a table that was just laid
out."""
PAUSE_S, FRESH_S = 0.5, 1.0
"""An arm of which nobody wanted a percept for so long rests: then one is waited for, for so long."""


class RemotePerception:
    """Implements robot.station_doors.Perceives and Sighted over the bus.

    Args:
        bus: open.
        scenario: which distances there are.
        tell: tells a measurement on the bus.
        measure: reads the arm anew, while it rests.
        gives_up: asked while a new table is waited for: somebody wants something more urgent.
        now_ns: this process's monotonic clock.
    """

    def __init__(
        self, bus: Bus, scenario: Scenario, *, tell: Callable[[ArmState], object], measure: Callable[[], ArmState],
        gives_up: Callable[[], bool] = lambda: False, now_ns: Callable[[], int] = monotonic_ns,
    ) -> None:  # fmt: skip
        assert PERCEPT.deadline_s is not None, "a percept grows old"
        self._tell, self._measure, self._gives_up, self._now_ns = tell, measure, gives_up, now_ns
        self._names, self._table_m = scenario.distances, scenario.table.height_m
        self._deadline_ns = round(PERCEPT.deadline_s * 1e9)
        self._came = Condition()
        self._newest: Received[Percept] | None = None
        self._n = 0
        self._is_new_table, self._looked_ns = True, now_ns()
        self._forgets = bus.asker(FORGET)
        self._subscriber = bus.subscriber(PERCEPT, self._take)

    def watch(self, cameras: Mapping[str, Camera]) -> None:
        """Look through none: the perception node has its own."""

    def connect(self) -> None:
        """Acquire nothing: percepts come where there are any."""

    def forget(self) -> None:
        """Have the perception node forget what it saw, and wait for percepts of the new table, at the next look."""
        self._is_new_table = True

    def perceive(self, arm: ArmState, scene: SceneState | None) -> Percept:
        """Return P(t), object poses and grip at the arm's stamp, or the newest that there is under its own.

        Raises:
            StaleStateError: no percept came for too long.
        """
        del scene  # the perception node has it
        is_new_table, self._is_new_table = self._is_new_table, False
        is_paused = self._now_ns() - self._looked_ns > PAUSE_S * 1e9
        if is_new_table:
            arm = self._await_table()
        elif is_paused:
            arm = self._await_fresh(arm)
        self._looked_ns = self._now_ns()
        self._tell(arm)
        with self._came:
            self._came.wait_for(lambda: self._is_at(arm), ANSWER_S)
            newest = self._newest
        self._check_age(newest)
        assert newest is not None, "it was checked"
        return newest.message if newest.message.stamp_ns == arm.stamp_ns else self._completed(newest, arm)

    def close(self) -> None:
        """Hear no more. Idempotent."""
        self._subscriber.close()

    def _await_table(self) -> ArmState:
        """Wait for some percepts from now on, until one knows where anything is, and return the arm as it is then.

        The arm rests and is measured anew all the time: a picture counts that was there when the arm was measured, and
        at the reset's own measurement there was none of the new table yet.

        Raises:
            StaleStateError: the perception node does not say that it has forgotten the table before.
            RobotError: the arm cannot be read.
        """
        try:
            self._forgets.ask(Forget())
        except BusError as error:
            self._is_new_table = True
            raise StaleStateError(f"a new table: {error}; does the perception node run?") from error
        self._newest = None
        end_ns = self._now_ns() + round(FIRST_S * 1e9)
        wanted = self._n + N_FIRST
        while not self._is_settled(wanted) and self._now_ns() < end_ns and not self._gives_up():
            self._tell(self._measure())
            with self._came:
                self._came.wait_for(lambda: self._is_settled(wanted), AGAIN_S)
        return self._measure()

    def _await_fresh(self, arm: ArmState) -> ArmState:
        """Wait for a percept of now, and return the arm as it is then: whoever perceives was not asked for a while."""
        end_ns = self._now_ns() + round(FRESH_S * 1e9)
        while not self._is_fresh() and self._now_ns() < end_ns and not self._gives_up():
            self._tell(arm)
            with self._came:
                self._came.wait_for(self._is_fresh, AGAIN_S)
            arm = self._measure()
        return arm

    def _is_fresh(self) -> bool:
        newest = self._newest
        return newest is not None and self._now_ns() - newest.stamp_ns <= self._deadline_ns

    def _is_settled(self, wanted: int) -> bool:
        """Whether so many percepts came, and the newest shows a table: a camera needs a frame of it first."""
        newest = self._newest
        if self._n < wanted or newest is None:
            return False
        things = newest.message.objects
        return not things or any(thing.is_valid for thing in things)

    def _is_at(self, arm: ArmState) -> bool:
        return self._newest is not None and self._newest.message.stamp_ns == arm.stamp_ns

    def _check_age(self, newest: Received[Percept] | None) -> None:
        limit_ms = self._deadline_ns / 1e6
        expected = f"percept: expected one not older than {limit_ms:g} ms"
        if newest is None:
            wrong = self._subscriber.error
            raise StaleStateError(f"{expected}, none came{'' if wrong is None else f': {wrong}'}; does perception run?")
        age_ns = self._now_ns() - newest.stamp_ns
        if age_ns > self._deadline_ns:
            raise StaleStateError(f"{expected}, the newest is {age_ns / 1e6:.0f} ms old; does the perception node run?")

    def _completed(self, newest: Received[Percept], arm: ArmState) -> Percept:
        percept, tcp = newest.message, arm.tcp_position_m
        place = {thing.name: thing.position_m for thing in percept.objects}
        return msgspec.structs.replace(
            percept, stamp_ns=newest.stamp_ns, tcp_position_m=tcp, grip=arm.grip,
            distances_m=tuple([self._distance(tcp, place.get(name)) for name in self._names]),
        )  # fmt: skip

    def _distance(self, tcp_m: Vec3, place_m: Vec3 | None) -> float:
        """Return how far the tool is from a thing; from the table, which has no place, how high it is."""
        return abs(tcp_m[2] - self._table_m) if place_m is None else math.dist(tcp_m, place_m)

    def _take(self, received: Received[Percept]) -> None:
        with self._came:
            self._newest, self._n = received, self._n + 1
            self._came.notify_all()
