"""The twin with a camera: pictures are drawn as the world goes by, at their exposure, and had after their latency."""

from collections.abc import Mapping
from types import MappingProxyType

import msgspec
import numpy as np

from config.arm import ArmConfig
from config.cell import CellConfig
from config.rig import Rig
from config.scenario import Scenario
from robot.errors import RobotConfigError, WireError
from robot.frames import CameraSpec, Frame
from robot.hal.protocols import Arm, Camera, Resetter, SceneTruth
from robot.messages import PlantIdentity
from sim_twin.perturbing import moved
from sim_twin.plant import TwinPlant, TwinWorld
from sim_twin.render import HOW_TO_DRAW, NoGLError, light_lamps
from sim_twin.rendered_camera import Optics, RenderedCamera
from sim_twin.studio.viewing import RIG_VIEW, View

__all__ = ["CameraTwinPlant", "WatchingCamera", "view_of"]

RATE_HZ = 20.0
OPTICS = Optics(sharpness=1.0, read_noise=1.5, shot_noise=0.02, defocus_px=0.0, latency_s=0.03)
WAIT_TICKS = 100
STREAM = 0x43616D
"""Of a reset's seed, the part that is the camera's noise."""


class WatchingCamera:
    """A rendered camera that looks at every tick, and keeps the newest frame that has arrived until it is read."""

    def __init__(self, world: TwinWorld, view: View, *, optics: Optics = OPTICS, rate_hz: float = RATE_HZ) -> None:
        self._world = world
        lens = view.lens
        self.spec = CameraSpec(
            name=view.name, serial="twin", width_px=lens.width_px, height_px=lens.height_px, rate_hz=rate_hz
        )
        view.set_quality(world.model)
        rng = np.random.default_rng(0)
        self._rendered = RenderedCamera(
            model=world.model, data=world.data, spec=self.spec, lens=lens, T_bc=view.T_bc, optics=optics, rng=rng
        )
        self._newest: Frame | None = None
        self._is_open = False

    def connect(self) -> None:
        """Make what draws.

        Raises:
            RobotConfigError: nothing here can; the message says what to do.
        """
        try:
            self._rendered.connect()
        except NoGLError as error:
            raise RobotConfigError(f"{error}. {HOW_TO_DRAW}") from error
        self._newest, self._is_open = None, True

    def restart(self, rng: np.random.Generator) -> None:
        """Forget all frames; the next one is drawn at the next tick."""
        self._newest = None
        self._rendered.restart(rng)

    def watch(self) -> None:
        """Look at the world as it is after a tick."""
        if self._is_open:
            light_lamps(self._world)
            clock = self._world.clock  # it counts a tick once the tick is done
            self._newest = self._rendered.read(clock.now_ns() + clock.tick_ns) or self._newest

    @property
    def has_frame(self) -> bool:
        """Whether a frame waits to be read, or nobody is there to read one."""
        return self._newest is not None or not self._is_open

    def read(self, now_ns: int) -> Frame | None:
        """Return the newest frame that has arrived and was not returned before, or None.

        Raises:
            WireError: not connected.
        """
        del now_ns  # the world's own time counts
        if not self._is_open:
            raise WireError(f"camera {self.spec.name}: not connected")
        frame, self._newest = self._newest, None
        return frame

    def close(self) -> None:
        """Give up what draws. Idempotent."""
        self._rendered.close()
        self._is_open = False


class CameraTwinPlant:
    """The twin's plant with one camera over its table. The same seed and epoch are the same table and pictures."""

    def __init__(self, *, arm: ArmConfig, scenario: Scenario, rig: Rig, cell: CellConfig | None = None) -> None:
        twin = TwinPlant(arm=arm, scenario=scenario, rig=rig, cell=cell)
        self._twin = twin
        self._camera = WatchingCamera(twin.world, view_of(rig))
        twin.world.after_tick = self._camera.watch
        self.identity: PlantIdentity = twin.identity
        self.arm: Arm = twin.arm
        self.cameras: Mapping[str, Camera] = MappingProxyType({self._camera.spec.name: self._camera})
        self.truth: SceneTruth | None = twin.truth
        self.resetter: Resetter = _CameraResetter(twin, self._camera)

    @property
    def world(self) -> TwinWorld:
        """Model and data, for pictures and benches."""
        return self._twin.world

    @property
    def model_sha256(self) -> str:
        """Digest of the compiled model, as the plain twin's."""
        return self._twin.model_sha256


def view_of(rig: Rig) -> View:
    """Return the rig's view; a camera that was moved sees everything moved the other way."""
    if rig.perturbation is None:
        return RIG_VIEW
    x, y, z = rig.perturbation.percept_m
    eye, target = (moved(place, (-x, -y, -z)) for place in (RIG_VIEW.eye_m, RIG_VIEW.target_m))
    return msgspec.structs.replace(RIG_VIEW, eye_m=eye, target_m=target)


class _CameraResetter:
    """Lays the table out as the twin does, and waits until the camera has taken its first picture of it."""

    def __init__(self, twin: TwinPlant, camera: WatchingCamera) -> None:
        self._twin, self._camera = twin, camera

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Draw and place a layout, let everything settle, and wait for a picture.

        Raises:
            WireError: none came.
        """
        self._twin.resetter.reset(seed=seed, epoch=epoch, digital_out=digital_out)
        world = self._twin.world
        self._camera.restart(np.random.default_rng([seed, epoch, STREAM]))
        for _ in range(WAIT_TICKS):
            if self._camera.has_frame:
                return
            world.clock.wait_tick()
        raise WireError(f"camera {self._camera.spec.name}: expected a picture within {WAIT_TICKS} ticks, none came")
