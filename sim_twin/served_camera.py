"""A rendered camera of a twin in another process: the world's poses come over the bus, the light does not."""

from collections.abc import Callable
from time import monotonic_ns

import msgspec
import numpy as np

from config.arm import ArmConfig
from config.rig import Rig
from config.scenario import Scenario
from robot.bus import Bus, Received, Subscriber
from robot.bus.camera_rows import TwinPose
from robot.bus.topics import TWIN_POSE
from robot.errors import RobotConfigError, WireError
from robot.frames import CameraSpec, Frame
from sim_twin.camera_plant import OPTICS
from sim_twin.controller.motion import SLICE_S
from sim_twin.film import Film
from sim_twin.plant import TwinWorld
from sim_twin.render import HOW_TO_DRAW, NoGLError, light_lamps
from sim_twin.rendered_camera import RenderedCamera
from sim_twin.studio.viewing import SERVED_VIEW
from sim_twin.twin_pose import stand_as

__all__ = ["ServedCamera"]

LIGHT = msgspec.structs.replace(OPTICS, latency_s=0.0)
"""Drawing takes its time by itself, and a frame can be had when it is drawn."""


class ServedCamera:
    """Draws the world of the twin on a bus as one camera sees it (robot.hal.protocols.Camera). Simulation only.

    A frame is of the newest pose that came when it was due, and stamped as that was.

    Args:
        scenario: the table.
        arm: the arm's file.
        rig: of the controller.
        bus: open.
        now_ns: this machine's monotonic clock.

    Attributes:
        spec: what it is.
    """

    def __init__(
        self, *, scenario: Scenario, arm: ArmConfig, rig: Rig, bus: Bus, now_ns: Callable[[], int] = monotonic_ns
    ) -> None:
        if rig.camera is None or rig.camera.name != SERVED_VIEW.name:
            raise RobotConfigError(
                f"rig {rig.name}: expected the camera {SERVED_VIEW.name}, which is what the twin has"
            )
        lens = SERVED_VIEW.lens
        self._bus, self._now_ns = bus, now_ns
        self.spec = CameraSpec(
            name=SERVED_VIEW.name, serial="twin", width_px=lens.width_px, height_px=lens.height_px,
            rate_hz=rig.camera.rate_hz,
        )  # fmt: skip
        times = msgspec.structs.replace(rig, tick_s=SLICE_S, physics_s=SLICE_S)
        self._world = world = TwinWorld(arm, scenario, times)
        SERVED_VIEW.set_quality(world.model)
        rng = np.random.default_rng(0)
        self._rendered = RenderedCamera(
            model=world.model, data=world.data, spec=self.spec, lens=lens, T_bc=SERVED_VIEW.T_bc, optics=LIGHT,
            rng=rng, film=Film(read_noise=LIGHT.read_noise, shot_noise=LIGHT.shot_noise, rng=rng),
        )  # fmt: skip
        self._newest: Received[TwinPose] | None = None
        self._subscriber: Subscriber[TwinPose] | None = None
        self._is_open = False

    def connect(self) -> None:
        """Make what draws, and hear how the world stands.

        Raises:
            RobotConfigError: nothing here can draw; the message says what to do.
        """
        try:
            self._rendered.connect()
        except NoGLError as error:
            raise RobotConfigError(f"{error}. {HOW_TO_DRAW}") from error
        if self._subscriber is None:
            self._subscriber = self._bus.subscriber(TWIN_POSE, self._take)
        self._is_open = True

    def read(self, now_ns: int) -> Frame | None:
        """Return a frame of the world as it stood last, where one is due; None before.

        Raises:
            WireError: not connected, or the twin on the bus is of another model.
        """
        del now_ns  # what counts is when the world stood so
        if not self._is_open:
            raise WireError(f"camera {self.spec.name}: not connected")
        newest, self._newest = self._newest, None
        if newest is None:
            return None
        stand_as(self._world, newest.message)
        light_lamps(self._world)
        frame = self._rendered.read(newest.stamp_ns)
        return None if frame is None else msgspec.structs.replace(frame, arrival_ns=self._now_ns())

    def close(self) -> None:
        """Give up what draws. Idempotent."""
        if self._subscriber is not None:
            self._subscriber.close()
            self._subscriber = None
        self._rendered.close()
        self._is_open, self._newest = False, None

    def _take(self, received: Received[TwinPose]) -> None:
        self._newest = received
