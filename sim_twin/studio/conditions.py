"""What a photograph is taken under: light, exposure, noise, blur, a camera that moved since it was calibrated."""

from types import MappingProxyType

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.rendered_camera import Optics

__all__ = ["LEVELS", "Conditions", "Lighting", "drawn_conditions"]

Array = NDArray[np.float64]


class Spread(msgspec.Struct, frozen=True, kw_only=True):
    """How far one level goes: factors are the exponent of a uniform draw, the rest is drawn to either side."""

    light_log: float = 0.0
    """Each light's brightness."""
    tint_log: float = 0.0
    """Each channel of each light."""
    direction_m: float = 0.0
    """Each lamp of the room moves so far along each axis."""
    exposure_log: float = 0.0
    noise: tuple[float, float] = (0.0, 0.0)
    """Most of read noise and of shot noise."""
    defocus_px: float = 0.0
    turn_rad: float = 0.0
    """The camera has turned by as much about each axis since it was calibrated."""
    shift_m: float = 0.0


LEVELS = MappingProxyType(
    {
        "clean": Spread(noise=(1.0, 0.01)),
        "mild": Spread(
            light_log=0.1, tint_log=0.03, direction_m=0.15, exposure_log=0.1, noise=(2.0, 0.03), defocus_px=0.5,
            turn_rad=0.0003, shift_m=0.0003,
        ),
        "medium": Spread(
            light_log=0.25, tint_log=0.07, direction_m=0.4, exposure_log=0.25, noise=(4.0, 0.08), defocus_px=1.0,
            turn_rad=0.0007, shift_m=0.0007,
        ),
        "strong": Spread(
            light_log=0.5, tint_log=0.15, direction_m=0.8, exposure_log=0.5, noise=(8.0, 0.2), defocus_px=1.8,
            turn_rad=0.0015, shift_m=0.0015,
        ),
    }
)  # fmt: skip


class Conditions(msgspec.Struct, frozen=True, kw_only=True):
    """One draw."""

    lights: Array
    """What each light's channels are multiplied by, the light from everywhere last.  (n + 1, 3)"""
    moves_m: Array
    """(n, 3)"""
    optics: Optics
    turn_rad: Array
    shift_m: Array


def drawn_conditions(level: str, n_lights: int, sharpness: float, rng: np.random.Generator) -> Conditions:
    """Return a draw from a level. Raises KeyError where there is no such level."""
    spread = LEVELS[level]
    bright = rng.uniform(-1, 1, (n_lights + 1, 1)) * spread.light_log
    tint = rng.uniform(-1, 1, (n_lights + 1, 3)) * spread.tint_log
    return Conditions(
        lights=np.exp(bright + tint),
        moves_m=rng.uniform(-1, 1, (n_lights, 3)) * spread.direction_m,
        optics=Optics(
            exposure=float(np.exp(rng.uniform(-1, 1) * spread.exposure_log)),
            read_noise=float(rng.uniform(0, 1) * spread.noise[0]),
            shot_noise=float(rng.uniform(0, 1) * spread.noise[1]),
            defocus_px=float(rng.uniform(0, 1) * spread.defocus_px),
            sharpness=sharpness,
        ),
        turn_rad=rng.uniform(-1, 1, 3) * spread.turn_rad,
        shift_m=rng.uniform(-1, 1, 3) * spread.shift_m,
    )


class Lighting:
    """A model's lights as they were built, and changed from there."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._diffuse, self._place = model.light_diffuse.copy(), model.light_pos.copy()
        self._everywhere = np.array(model.vis.headlight.ambient), np.array(model.vis.headlight.diffuse)

    def apply(self, conditions: Conditions) -> None:
        """Light the model's world so."""
        model, (ambient, diffuse) = self._model, self._everywhere
        model.light_diffuse[:] = self._diffuse * conditions.lights[:-1]
        model.light_pos[:] = self._place + conditions.moves_m
        model.vis.headlight.ambient[:] = ambient * conditions.lights[-1]
        model.vis.headlight.diffuse[:] = diffuse * conditions.lights[-1]
