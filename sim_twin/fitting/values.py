"""What may be fitted of an arm: values' names, units, bounds, and how far off they may be before anything is seen."""

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.fitted import FittedPlant

__all__ = ["JOINTS", "N_VALUES", "VALUES", "Value", "plant_of", "vector_of"]

Array = NDArray[np.float64]
JOINTS = ("base", "shoulder", "elbow", "wrist_1", "wrist_2", "wrist_3")


class Value(msgspec.Struct, frozen=True, kw_only=True):
    """One number of the plant."""

    kind: str
    joint: str = ""
    unit: str
    low: float
    high: float
    scale: float
    """How far from the file's it may well be: what is not told closer than a share of this is not told at all."""
    step: float
    """Of differences."""
    inside: tuple[float, float, float] = (-np.inf, -np.inf, -np.inf)
    """Where fits begin at least, one start after another."""

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{self.kind} {self.joint}".strip()


def _each(kind: str, unit: str, low: float, high: float, scales: tuple[float, float], step: float) -> list[Value]:
    """Return a value of each joint; scales are of the large joints and of the wrists."""
    return [
        Value(kind=kind, joint=joint, unit=unit, low=low, high=high, scale=scales[i > 2], step=step * scales[i > 2])
        for i, joint in enumerate(JOINTS)
    ]


VALUES: tuple[Value, ...] = (
    *_each("lag", "s", 0.002, 0.5, (0.03, 0.03), 0.002),
    *_each("stiffness", "Nm/rad", 60.0, 100_000.0, (3_000.0, 600.0), 0.01),
    *_each("friction", "Nm", 0.0, 150.0, (10.0, 3.0), 0.01),
    Value(kind="payload", unit="kg", low=-5.0, high=15.0, scale=2.0, step=0.01),
    Value(kind="dead time", unit="s", low=0.0, high=0.06, scale=0.01, step=1e-4),
    Value(kind="smoothing", unit="s", low=0.0, high=0.25, scale=0.03, step=3e-4, inside=(0.01, 0.03, 0.002)),
)
N_VALUES = len(VALUES)


def vector_of(plant: FittedPlant) -> Array:
    """Return a plant's numbers in the order of VALUES.  () -> (n,)"""
    return np.array(
        [
            *plant.lag_s, *plant.stiffness_nm_rad, *plant.friction_nm, plant.payload_kg, plant.dead_time_s,
            plant.smoothing_s,
        ]
    )  # fmt: skip


def plant_of(x: Array, like: FittedPlant) -> FittedPlant:
    """Return the plant of such a vector, its lengths as in another.  (n,) -> ()"""
    lag, stiffness, friction = (tuple(x[6 * k : 6 * k + 6].tolist()) for k in range(3))
    payload, dead_time, smoothing = x[18:21].tolist()
    return msgspec.structs.replace(
        like, lag_s=lag, stiffness_nm_rad=stiffness, friction_nm=friction, payload_kg=payload, dead_time_s=dead_time,
        smoothing_s=smoothing,
    )  # fmt: skip
