"""The perception node: a rig's percept over the bus, at each measurement of the arm and in between. State and edge.

It answers a measurement at once with the percept at that stamp, so that who moves the arm need not wait for a clock. In
between it perceives fifty times a second from the newest measurement and the newest truth. Where either is missing or
too old it says nothing: its silence is what stops the arm.
"""

from collections.abc import Callable
from threading import Condition
from time import monotonic_ns

import msgspec

from config.resolved import Resolved
from config.scenario import Scenario
from perception.ground_truth import TABLE
from robot.bus import TRUTH, Bus, Received, Role
from robot.bus.errors import BusError
from robot.bus.topics import ARM_STATE, PERCEPT
from robot.errors import RobotConfigError, RobotError
from robot.messages import ArmState, Percept, SceneState
from robot.node.pulse import HealthTeller, Pulse
from robot.rigs import build_perception, check_usable
from robot.station_doors import Perceives, Sighted

__all__ = ["PerceptionNode", "aged", "run_perception"]

LOOK_S, PERIOD_NS = 0.01, 20_000_000
ARM_NS = 500_000_000
"""An idle arm is measured ten times a second: older, and nothing is known of where the tool is."""


class PerceptionNode:
    """Perceives until it is told to end.

    Args:
        bus: open; this process is a perception there.
        perception: makes the percepts, from truth.
        scenario: which distances there are.
        now_ns: this process's monotonic clock.

    Attributes:
        pulse: how its loop goes.
    """

    def __init__(
        self, bus: Bus, perception: Perceives, scenario: Scenario, *, now_ns: Callable[[], int] = monotonic_ns
    ) -> None:
        assert TRUTH.deadline_s is not None, "truth grows old"
        self._perception, self._now_ns = perception, now_ns
        self._is_seen = tuple(name != TABLE for name in scenario.distances)
        self._truth_ns = round(TRUTH.deadline_s * 1e9)
        self.pulse = Pulse(target_hz=PERCEPT.rate_hz, now_ns=now_ns)
        self._came = Condition()
        self._arm: Received[ArmState] | None = None
        self._scene: Received[SceneState] | None = None
        self._is_asked = False
        self._told_ns = 0
        self._says = bus.publisher(PERCEPT)
        self._open = bus.subscriber(ARM_STATE, self._take_arm), bus.subscriber(TRUTH, self._take_scene)

    def run(self, is_over: Callable[[], bool]) -> None:
        """Perceive until told that it is over."""
        while not is_over():
            with self._came:
                self._came.wait_for(lambda: self._is_asked, LOOK_S)
            self.turn()
        for subscriber in self._open:
            subscriber.close()

    def turn(self) -> None:
        """Perceive, where a measurement has come or it is time."""
        is_asked, self._is_asked = self._is_asked, False
        now_ns = self._now_ns()
        if not is_asked and now_ns - self._told_ns < PERIOD_NS:
            return
        self.pulse.beat()
        arm, scene = self._arm, self._scene
        why = self._why_blind(arm, scene, now_ns)
        self.pulse.doing = why or "perceives"
        if why is not None or arm is None or scene is None:
            return
        try:
            percept = self._perception.perceive(arm.message, scene.message)
            age_s = max(0, arm.stamp_ns - scene.stamp_ns) / 1e9
            self._says.put(aged(percept, age_s, self._is_seen), stamp_ns=min(scene.stamp_ns, now_ns))
            self._told_ns = now_ns
        except (RobotError, BusError) as error:
            self.pulse.fail(str(error))

    def _why_blind(self, arm: Received[ArmState] | None, scene: Received[SceneState] | None, now_ns: int) -> str | None:
        if scene is None or now_ns - scene.stamp_ns > self._truth_ns:
            return "waits for the twin's truth"
        if arm is None or now_ns - arm.stamp_ns > ARM_NS:
            return "waits for a measurement of the arm"
        return None

    def _take_arm(self, received: Received[ArmState]) -> None:
        with self._came:
            self._arm, self._is_asked = received, True
            self._came.notify_all()

    def _take_scene(self, received: Received[SceneState]) -> None:
        self._scene = received


def aged(percept: Percept, age_s: float, is_seen: tuple[bool, ...]) -> Percept:
    """Return a percept whose things were seen so long before its stamp; what the arm knows by itself is not older.

    Args:
        percept: of things as they are now.
        age_s: how long before.
        is_seen: of each distance, whether it is to a thing that was seen.
    """
    own = percept.ages_s[len(is_seen) :]
    ages_s = (*(a + age_s * s for a, s in zip(percept.ages_s[: len(is_seen)], is_seen, strict=True)), *own)
    things = tuple([msgspec.structs.replace(thing, age_s=thing.age_s + age_s) for thing in percept.objects])
    return msgspec.structs.replace(percept, ages_s=ages_s, objects=things)


def run_perception(resolved: Resolved, *, end: Callable[[], bool]) -> None:
    """Run a rig's perception node until it is over.

    Raises:
        RobotConfigError: the rig has no bus, or its perception looks through a camera, which no bus brings yet.
        BusError: nobody listens at its endpoint.
    """
    rig = resolved.rig
    check_usable(rig)
    if rig.bus is None:
        raise RobotConfigError(f"rig {rig.name}: expected the endpoint of its bus, came none: its processes are one")
    perception = build_perception(resolved)
    if isinstance(perception, Sighted):
        raise RobotConfigError(
            f"rig {rig.name}: expected a perception from truth, came one through a camera: no process brings its "
            "pictures over the bus yet; leave the node out, and the process that holds the arm perceives by itself"
        )
    with Bus(rig.bus, serial=rig.expected.serial, role=Role.PERCEPTION, keys=rig.keys) as bus:
        node = PerceptionNode(bus, perception, resolved.scenario)
        health = HealthTeller(bus, node.pulse)
        try:
            node.run(end)
        finally:
            health.close()
