"""A camera in a simulated world: renders straight, then bends, blurs, exposes, adds noise, and delivers late."""

from collections import deque
from typing import Annotated

import msgspec
import mujoco
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from robot.compiled import Bytes3, Floats3, compiled
from robot.errors import WireError
from robot.frames import CameraSpec, Frame, frame_of
from sim_twin.film import Film
from sim_twin.lens import TrueLens, directions, half_angles, source_map
from sim_twin.render import NoGLError

__all__ = ["Optics", "RenderedCamera", "develop", "sampled"]

Share = Annotated[float, Meta(ge=0.0)]
NEAR_M, FAR_M = 0.02, 20.0
WHITE = 255.0
BLUR_REACH = 3.0
"""How many standard deviations of a blur are reckoned with."""


class Optics(msgspec.Struct, frozen=True, kw_only=True):
    """What befalls light between the lens and the frame."""

    exposure: Share = 1.0
    """1 leaves the picture as bright as it is drawn."""
    exposure_s: Share = 0.0
    """How long the shutter is open: what moves is smeared by as much of its way."""
    n_smear: Annotated[int, Meta(ge=1, le=64)] = 1
    """In how many instants the exposure is drawn."""
    defocus_px: Share = 0.0
    read_noise: Share = 0.0
    """Standard deviation in the dark, of 255."""
    shot_noise: Share = 0.0
    """Variance per grey level."""
    latency_s: Share = 0.0
    """From the middle of the exposure to when the frame can be had."""
    sharpness: Annotated[float, Meta(ge=1.0, le=4.0)] = 2.0
    """Pixels drawn for each pixel along a side of the picture."""


class RenderedCamera:
    """Draws the world of a model and its data as one camera sees it.

    The world is drawn at a read that comes when a frame is due, with what the data holds then, and is given by the
    first read that is its latency later: call it every tick. Two cameras of one seed give the same frames.

    Args:
        model: The world.
        data: Its state, somebody else's; only read.
        spec: Name, serial, picture size and rate.
        lens: The lens, of the same picture size.
        T_bc: Where the camera is, base frame: z ahead, x to the right, y down in the picture.
        optics: What befalls the light.
        rng: Noise of this camera alone.
        film: Exposes in a quarter of the time, for optics in focus that neither smear nor brighten; its own noise then
            counts. None exposes as `develop` does.
    """

    def __init__(
        self, *, model: mujoco.MjModel, data: mujoco.MjData, spec: CameraSpec, lens: TrueLens,
        T_bc: NDArray[np.float64], optics: Optics, rng: np.random.Generator, film: Film | None = None,
    ) -> None:  # fmt: skip
        if (lens.width_px, lens.height_px) != (spec.width_px, spec.height_px):
            raise ValueError(f"camera {spec.name}: expected a lens of {spec.width_px} × {spec.height_px}")
        self.spec, self.T_bc, self._film = spec, T_bc, film
        self._check_film(optics)
        self._model, self._data, self._own = model, data, mujoco.MjData(model)
        self._optics, self._rng = optics, rng
        tangents = directions(lens)
        self._half = half_angles(tangents)
        self._size = (round(lens.width_px * optics.sharpness), round(lens.height_px * optics.sharpness))
        self._sources = source_map(tangents, self._half, self._size)
        self._renderer: mujoco.Renderer | None = None
        self._waiting: deque[Frame] = deque()
        self._n_taken, self._next_ns = 0, -1

    def connect(self) -> None:
        """Make what draws off-screen; the first frame is due at the first read.

        Raises:
            NoGLError: nothing here can.
        """
        self.close()
        width, height = self._size
        self._model.vis.global_.offwidth = max(self._model.vis.global_.offwidth, width)
        self._model.vis.global_.offheight = max(self._model.vis.global_.offheight, height)
        try:
            self._renderer = mujoco.Renderer(self._model, height, width)
        except (ImportError, AttributeError, RuntimeError, mujoco.FatalError) as error:
            raise NoGLError(f"camera {self.spec.name}: expected an off-screen GL, it said: {error}") from error
        self._waiting.clear()
        self._n_taken, self._next_ns = 0, -1

    def restart(self, rng: np.random.Generator) -> None:
        """Forget what was taken, and draw anew at the next read, with other noise: nothing before is remembered."""
        self._waiting.clear()
        self._next_ns, self._rng = -1, rng

    def adjust(self, *, optics: Optics, T_bc: NDArray[np.float64], rng: np.random.Generator) -> None:
        """Take the frames to come through another path of light, from another place, with other noise.

        Raises:
            ValueError: a sharpness other than the one it was made with, or what its film cannot show.
        """
        self._check_film(optics)
        if optics.sharpness != self._optics.sharpness:
            raise ValueError(f"camera {self.spec.name}: expected sharpness {self._optics.sharpness:g} as it was made")
        self._optics, self.T_bc, self._rng = optics, T_bc, rng

    def read(self, now_ns: int) -> Frame | None:
        """Return the newest frame that has arrived by now and was not returned before, or None.

        Raises:
            WireError: not connected.
        """
        if self._renderer is None:
            raise WireError(f"camera {self.spec.name}: not connected")
        if now_ns >= self._next_ns:
            self._take(now_ns)
        newest = None
        while self._waiting and self._waiting[0].arrival_ns <= now_ns:
            newest = self._waiting.popleft()
        return newest

    def close(self) -> None:
        """Give up what draws."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _take(self, now_ns: int) -> None:
        """Draw the world as it is now, and put the frame where it waits."""
        period_ns = round(1e9 / self.spec.rate_hz)
        # The grid goes on from the last frame, not from this read, else a slow caller would slow the camera down.
        self._next_ns = now_ns + period_ns if self._next_ns < 0 else self._next_ns + period_ns
        while self._next_ns <= now_ns:
            self._next_ns += period_ns
            self._n_taken += 1  # a frame that nobody was there to have drawn: lost, and its number with it
        picture = self._picture()
        self._waiting.append(
            frame_of(
                picture, camera=self.spec.name, sequence=self._n_taken, stamp_ns=now_ns,
                arrival_ns=now_ns + round(self._optics.latency_s * 1e9),
            )
        )  # fmt: skip
        self._n_taken += 1

    def _check_film(self, optics: Optics) -> None:
        if self._film is not None and (optics.n_smear, optics.defocus_px, optics.exposure) != (1, 0.0, 1.0):
            raise ValueError(f"camera {self.spec.name}: expected optics in focus, exposed once at 1, for a quick film")

    def _picture(self) -> NDArray[np.uint8]:
        """Return what the frame holds.  -> (height, width, 3)"""
        if self._film is None:
            return develop(self._light(), self._optics, self._rng)
        self._stand(0.0)
        return self._film.expose(self._drawn(self._own), self._sources)

    def _light(self) -> NDArray[np.float64]:
        """Return what falls on the sensor while the shutter is open, 0 to 255.  -> (height, width, 3)"""
        n = self._optics.n_smear
        total = np.zeros((*self._sources.shape[:2], 3))
        for k in range(n):
            self._stand(((k + 0.5) / n - 0.5) * self._optics.exposure_s)
            total += sampled(self._drawn(self._own), self._sources)
        return total / n

    def _stand(self, dt_s: float) -> None:
        """Have what is drawn stand as the world does, or a moment from then."""
        data, own = self._data, self._own
        # With sleeping on, what cannot move is placed by a reset and never again: a table laid out anew was drawn as
        # it had been when the camera was made.
        mujoco.mj_resetData(self._model, own)
        own.qpos[:], own.mocap_pos[:], own.mocap_quat[:] = data.qpos, data.mocap_pos, data.mocap_quat
        if dt_s:
            mujoco.mj_integratePos(self._model, own.qpos, data.qvel, dt_s)
        mujoco.mj_kinematics(self._model, own)
        mujoco.mj_camlight(self._model, own)

    def _drawn(self, data: mujoco.MjData) -> NDArray[np.uint8]:
        """Return the world through a straight lens."""
        renderer = self._renderer
        assert renderer is not None
        option = mujoco.MjvOption()
        option.sitegroup[:] = 0
        option.geomgroup[:] = (1, 1, 1, 0, 0, 0)
        renderer.update_scene(data, mujoco.MjvCamera(), option)
        half_x, half_y = self._half
        for eye in renderer.scene.camera:
            eye.pos, eye.forward, eye.up = self.T_bc[:3, 3], self.T_bc[:3, 2], -self.T_bc[:3, 1]
            eye.frustum_center, eye.frustum_width = 0.0, half_x * NEAR_M
            eye.frustum_bottom, eye.frustum_top = -half_y * NEAR_M, half_y * NEAR_M
            eye.frustum_near, eye.frustum_far = NEAR_M, FAR_M
        return np.ascontiguousarray(renderer.render())


@compiled
def sampled(picture: Bytes3, places: Floats3) -> Floats3:
    """Return a picture's colours between pixels, bilinear.  (h, w, 3), (m, n, 2) x and y -> (m, n, 3)"""
    height, width, n_channels = picture.shape
    found = np.empty((places.shape[0], places.shape[1], n_channels))
    for i in range(places.shape[0]):
        for j in range(places.shape[1]):
            x = min(max(places[i, j, 0], 0.0), width - 1.001)
            y = min(max(places[i, j, 1], 0.0), height - 1.001)
            left, upper = int(x), int(y)
            u, v = x - left, y - upper
            for k in range(n_channels):
                above = picture[upper, left, k] * (1.0 - u) + picture[upper, left + 1, k] * u
                below = picture[upper + 1, left, k] * (1.0 - u) + picture[upper + 1, left + 1, k] * u
                found[i, j, k] = above * (1.0 - v) + below * v
    return found


def develop(light: NDArray[np.float64], optics: Optics, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return light as bytes: out of focus, exposed, with noise, cut off where the sensor is full.  (h, w, 3)"""
    seen = _blurred(light, optics.defocus_px) * optics.exposure
    if optics.read_noise or optics.shot_noise:
        spread = np.sqrt(optics.read_noise**2 + optics.shot_noise * seen)
        seen = seen + spread * rng.standard_normal(seen.shape)
    return np.clip(np.round(seen), 0.0, WHITE).astype(np.uint8)


def _blurred(light: NDArray[np.float64], spread_px: float) -> NDArray[np.float64]:
    """Return light through a Gaussian, rows then columns; the edge's own colour goes on beyond it."""
    reach = int(np.ceil(BLUR_REACH * spread_px))
    if reach == 0:
        return light
    offsets = np.arange(-reach, reach + 1)
    weights = np.exp(-0.5 * (offsets / spread_px) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        pad = [(reach, reach) if i == axis else (0, 0) for i in range(light.ndim)]
        wide, n = np.pad(light, pad, mode="edge"), light.shape[axis]
        light = sum(w * wide.take(range(k, k + n), axis) for k, w in enumerate(weights))  # type: ignore[assignment]
    return light
