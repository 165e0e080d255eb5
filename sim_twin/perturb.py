"""The perturbed plants that a check goes through: the physics is changed, nobody is told."""

import msgspec

from config.perturbation import Perturbation
from config.resolved import Resolved
from sim_twin.plant import TwinPlant

__all__ = ["NOMINAL", "PERTURBATIONS", "perturbed_plant"]

NOMINAL = Perturbation(name="nominal")
PERTURBATIONS = (
    NOMINAL,
    Perturbation(name="lag_x2", lag_factor=2.0),
    Perturbation(name="braking_half", braking_factor=0.5),
    Perturbation(name="payload_plus_1kg", payload_kg=1.0),
    Perturbation(name="payload_minus_1kg", payload_kg=-1.0),
    Perturbation(name="kinematics_plus_2mm", kinematics_m=0.002),
)
"""Those that a check goes through, the nominal plant first."""


def perturbed_plant(resolved: Resolved, by: Perturbation) -> TwinPlant:
    """Return a twin whose physics is perturbed; a station on it is built from the files as they are."""
    rig = msgspec.structs.replace(resolved.rig, perturbation=by)
    return TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=rig)
