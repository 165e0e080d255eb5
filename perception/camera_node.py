"""The camera node: owns one camera, puts its frames into shared memory and announces each on the bus. State and edge.

A camera that fails or falls silent is let go of and taken anew, with growing pauses; whoever perceives judges by the
frames' own stamps meanwhile.
"""

from collections.abc import Callable
from time import monotonic_ns, sleep

from config.resolved import Resolved
from perception.cameras.ring import FrameWriter
from robot.bus import Bus, Role
from robot.bus.camera_rows import FrameNote
from robot.bus.topics import CAMERA_FRAME, CAMERA_IMAGE
from robot.errors import RobotConfigError, RobotError
from robot.frames import Frame
from robot.hal.protocols import Camera
from robot.node.pulse import HealthTeller, Pulse
from robot.recording.images import ImageCoder, image_coder
from robot.rigs import build_camera, check_usable

__all__ = ["CameraNode", "run_camera"]

LOOK_S = 0.003
SILENT_NS = 2_000_000_000
"""A camera that gave nothing for so long is taken anew."""
FIRST_PAUSE_NS, MOST_PAUSE_NS = 500_000_000, 8_000_000_000


class CameraNode:
    """Shows what a camera takes until it is told to end.

    Args:
        bus: open; this process is a camera there.
        camera: not yet connected to.
        images: compresses frames for whoever records them; None where nobody may.
        now_ns: this process's monotonic clock.

    Attributes:
        pulse: how its frames come.
    """

    def __init__(
        self, bus: Bus, camera: Camera, *, images: ImageCoder | None = None, now_ns: Callable[[], int] = monotonic_ns
    ) -> None:
        self._camera, self._images, self._now_ns = camera, images, now_ns
        self._pictures = bus.publisher(CAMERA_IMAGE)
        self._owner = f"{bus.serial}.{bus.source}"
        self._notes = bus.publisher(CAMERA_FRAME)
        self._memory: FrameWriter | None = None
        self._is_connected = False
        self._again_ns, self._pause_ns = now_ns(), FIRST_PAUSE_NS
        self._heard_ns = 0
        """When it was connected to, or gave a frame last."""
        self.pulse = Pulse(target_hz=camera.spec.rate_hz, now_ns=now_ns)

    def run(self, is_over: Callable[[], bool]) -> None:
        """Show frames until told that it is over."""
        try:
            while not is_over():
                self.turn()
                sleep(LOOK_S)
        finally:
            self.close()

    def turn(self) -> None:
        """Look whether there is a frame, and show it.

        Raises:
            RobotConfigError: it is no such camera as its file says, or there is no room: no later try mends that.
        """
        try:
            if self._is_connected or self._connect():
                self._look()
        except RobotConfigError:
            raise
        except RobotError as error:
            self._lose(str(error))

    def close(self) -> None:
        """Let go of the camera and of the memory. Idempotent."""
        self._camera.close()
        self._is_connected = False
        if self._memory is not None:
            self._memory.close()
            self._memory = None

    def _connect(self) -> bool:
        now_ns = self._now_ns()
        if now_ns < self._again_ns:
            return False
        self._camera.connect()
        self._is_connected, self._heard_ns = True, now_ns
        return True

    def _look(self) -> None:
        now_ns = self._now_ns()
        frame = self._camera.read(now_ns)
        if frame is not None:
            self._show(frame)
            self._heard_ns, self._pause_ns = now_ns, FIRST_PAUSE_NS
        elif now_ns - self._heard_ns > SILENT_NS:
            self._lose(f"camera {self._camera.spec.name}: expected a frame, none came for {SILENT_NS / 1e9:g} s")

    def _show(self, frame: Frame) -> None:
        if self._memory is None or self._memory.n_bytes != len(frame.pixels):
            if self._memory is not None:
                self._memory.close()
            self._memory = FrameWriter(self._owner, n_bytes=len(frame.pixels))
        number = self._memory.put(frame)
        note = FrameNote(
            camera=frame.camera, serial=self._camera.spec.serial, sequence=frame.sequence, stamp_ns=frame.stamp_ns,
            arrival_ns=frame.arrival_ns, width_px=frame.width_px, height_px=frame.height_px, memory=self._memory.name,
            number=number,
        )  # fmt: skip
        self._notes.put(note, stamp_ns=frame.stamp_ns)
        if self._images is not None and self._pictures.is_read:
            self._pictures.put(self._images.encode(frame), stamp_ns=frame.stamp_ns)
        self.pulse.beat()
        self.pulse.doing = "shows"

    def _lose(self, why: str) -> None:
        """Let go of a camera that failed, and try it again after a pause."""
        self.pulse.fail(why)
        self.pulse.doing = "waits for its camera"
        self._camera.close()
        self._is_connected = False
        self._again_ns = self._now_ns() + self._pause_ns
        self._pause_ns = min(MOST_PAUSE_NS, 2 * self._pause_ns)


def run_camera(resolved: Resolved, *, end: Callable[[], bool]) -> None:
    """Run the process of a rig's camera until it is over.

    Raises:
        RobotConfigError: the rig has no bus, or no camera that a process could own.
        BusError: nobody listens at its endpoint.
    """
    rig = resolved.rig
    check_usable(rig)
    if rig.bus is None:
        raise RobotConfigError(f"rig {rig.name}: expected the endpoint of its bus, came none: its processes are one")
    with Bus(rig.bus, serial=rig.expected.serial, role=Role.CAMERA, keys=rig.keys) as bus:
        node = CameraNode(bus, build_camera(resolved, bus), images=image_coder(rig.camera))
        health = HealthTeller(bus, node.pulse)
        try:
            node.run(end)
        finally:
            health.close()
