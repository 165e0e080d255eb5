"""The perception node: a rig's percept over the bus, at each measurement of the arm and in between. State and edge.

It answers a measurement at once with the percept at that stamp, so that who moves the arm need not wait for a clock. In
between it perceives fifty times a second from the newest measurement and the newest truth, or a camera's newest frame.
Where either is missing or too old it says nothing: its silence is what stops the arm. Of a camera's frames each entry
tells how old the one is that it is from.
"""

from collections.abc import Callable
from threading import Condition
from time import monotonic_ns
from typing import Protocol, runtime_checkable

import msgspec

from config.resolved import Resolved
from config.scenario import Scenario
from perception.cameras.over_bus import BusCamera
from perception.ground_truth import TABLE
from robot.bus import TRUTH, Bus, Received, Role
from robot.bus.camera_rows import Forgotten, Light
from robot.bus.errors import BusError
from robot.bus.topics import ARM_STATE, FORGET, LIGHT, PERCEPT
from robot.errors import RobotConfigError, RobotError
from robot.frames import CameraSpec
from robot.messages import ArmState, Percept, SceneState
from robot.node.pulse import HealthTeller, Pulse
from robot.rigs import build_perception, check_usable
from robot.station_doors import Perceives, Sighted

__all__ = ["PerceptionNode", "aged", "run_perception"]

LOOK_S, PERIOD_NS, LIGHT_NS = 0.01, 20_000_000, 500_000_000
ARM_NS = 500_000_000
"""An idle arm is measured ten times a second: older, and nothing is known of where the tool is."""


@runtime_checkable
class Calibrated(Sighted, Protocol):
    """A perception that knows which camera it looks through before it has one."""

    shown_ns: int | None
    """When the newest picture that shows the table was exposed; None before one."""

    @property
    def camera_spec(self) -> CameraSpec:
        """Which camera, as it was calibrated."""
        ...


class PerceptionNode:
    """Perceives until it is told to end.

    Args:
        bus: open; this process is a perception there.
        perception: makes the percepts, from truth or from a camera's frames.
        scenario: which distances there are.
        camera: whose frames these are, already watched by the perception; None where truth is perceived.
        now_ns: this process's monotonic clock.

    Attributes:
        pulse: how its loop goes.
    """

    def __init__(
        self, bus: Bus, perception: Perceives, scenario: Scenario, *, camera: BusCamera | None = None,
        now_ns: Callable[[], int] = monotonic_ns,
    ) -> None:  # fmt: skip
        assert TRUTH.deadline_s is not None, "truth grows old"
        self._perception, self._camera, self._now_ns = perception, camera, now_ns
        self._is_seen = tuple(name != TABLE for name in scenario.distances)
        self._truth_ns = round(TRUTH.deadline_s * 1e9)
        self.pulse = Pulse(target_hz=PERCEPT.rate_hz, now_ns=now_ns)
        self._came = Condition()
        self._arm: Received[ArmState] | None = None
        self._scene: Received[SceneState] | None = None
        self._is_asked = False
        self._told_ns = 0
        self._says, self._forgets = bus.publisher(PERCEPT), bus.answerer(FORGET)
        self._lights = None if camera is None else bus.publisher(LIGHT)
        self._begun_ns = self._light_ns = now_ns()
        self._arms = bus.subscriber(ARM_STATE, self._take_arm)
        self._scenes = bus.subscriber(TRUTH, self._take_scene) if camera is None else None

    def run(self, is_over: Callable[[], bool]) -> None:
        """Perceive until told that it is over."""
        while not is_over():
            with self._came:
                self._came.wait_for(lambda: self._is_asked, LOOK_S)
            self.turn()
        self._arms.close()
        if self._scenes is not None:
            self._scenes.close()

    def turn(self) -> None:
        """Perceive, where a measurement has come or it is time."""
        self._forget()
        self._tell_light()
        is_asked, self._is_asked = self._is_asked, False
        now_ns = self._now_ns()
        if not is_asked and now_ns - self._told_ns < PERIOD_NS:
            return
        self.pulse.beat()
        arm, scene = self._arm, self._scene
        why = self._why_blind(arm, scene, now_ns)
        self.pulse.doing = why or self._doing()
        if why is not None or arm is None:
            return
        try:
            percept, stamp_ns = self._perceive(arm, scene)
            self._says.put(percept, stamp_ns=min(stamp_ns, now_ns))
            self._told_ns = now_ns
        except (RobotError, BusError) as error:
            self.pulse.fail(str(error))

    def _perceive(self, arm: Received[ArmState], scene: Received[SceneState] | None) -> tuple[Percept, int]:
        """Return the percept at a measurement, and by this process's clock when it was so."""
        if self._camera is None:
            assert scene is not None, "it is not blind"
            percept = self._perception.perceive(arm.message, scene.message)
            age_s = max(0, arm.stamp_ns - scene.stamp_ns) / 1e9
            return aged(percept, age_s, self._is_seen), scene.stamp_ns
        # Frames are stamped by this machine's clock. A measurement of another machine counts from its arrival, as all
        # that comes from there; its percept bears its own stamp, by which it is asked for.
        here = arm.message if arm.age_ns is not None else msgspec.structs.replace(arm.message, stamp_ns=arm.stamp_ns)
        percept = self._perception.perceive(here, None)
        return msgspec.structs.replace(percept, stamp_ns=arm.message.stamp_ns), here.stamp_ns

    def _why_blind(self, arm: Received[ArmState] | None, scene: Received[SceneState] | None, now_ns: int) -> str | None:
        if self._camera is None and (scene is None or now_ns - scene.stamp_ns > self._truth_ns):
            return "waits for the twin's truth"
        if arm is None or now_ns - arm.stamp_ns > ARM_NS:
            return "waits for a measurement of the arm"
        return None

    def _doing(self) -> str:
        """Return in words what it does, with what became of a camera's frames."""
        if self._camera is None:
            return "perceives"
        counts = self._camera.counts
        return f"perceives: {counts.read} frames, {counts.lost} lost, {counts.torn} torn, {counts.late} late"

    def _tell_light(self) -> None:
        """Tell twice a second for how long no picture has shown the table, where there are pictures."""
        now_ns, seen = self._now_ns(), self._perception
        if self._lights is None or self._camera is None or now_ns - self._light_ns < LIGHT_NS:
            return
        self._light_ns = now_ns
        shown_ns = seen.shown_ns if isinstance(seen, Calibrated) else None
        dark_ns = max(0, now_ns - (self._begun_ns if shown_ns is None else shown_ns))
        try:
            self._lights.put(Light(camera=self._camera.spec.name, dark_s=dark_ns / 1e9))
        except BusError as error:
            self.pulse.fail(str(error))

    def _forget(self) -> None:
        """Begin anew, where the table was laid out: nothing of it before counts from the answer on."""
        asked = self._forgets.next()
        if asked is None:
            return
        if isinstance(self._perception, Sighted):
            self._perception.forget()
        if self._camera is not None:
            self._camera.forget()
        asked.answer(Forgotten())

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
        RobotConfigError: the rig has no bus, or its camera's files are wrong.
        BusError: nobody listens at its endpoint.
    """
    rig = resolved.rig
    check_usable(rig)
    if rig.bus is None:
        raise RobotConfigError(f"rig {rig.name}: expected the endpoint of its bus, came none: its processes are one")
    perception = build_perception(resolved)
    with Bus(rig.bus, serial=rig.expected.serial, role=Role.PERCEPTION, keys=rig.keys) as bus:
        camera = _camera_of(perception, bus)
        node = PerceptionNode(bus, perception, resolved.scenario, camera=camera)
        health = HealthTeller(bus, node.pulse)
        try:
            node.run(end)
        finally:
            health.close()
            if isinstance(perception, Sighted):
                perception.close()


def _camera_of(perception: Perceives, bus: Bus) -> BusCamera | None:
    """Return the camera that a perception looks through over the bus, given to it and connected; None without one.

    Raises:
        RobotConfigError: it looks through cameras, and not in a way that is known here.
    """
    if isinstance(perception, Calibrated):
        camera = BusCamera(bus, perception.camera_spec)
        perception.watch({camera.spec.name: camera})
        perception.connect()
        return camera
    if isinstance(perception, Sighted):
        raise RobotConfigError(
            f"expected a perception from truth, or one that tells which camera it needs, came {type(perception)}"
        )
    return None
