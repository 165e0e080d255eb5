"""How a plant of a rig differs from its files, so that it is seen what the stack above bears. Simulated worlds only."""

from typing import Annotated

from msgspec import Meta

from config.values import Length, Name, Section

__all__ = ["Perturbation"]

Factor = Annotated[float, Meta(ge=0.1, le=10.0)]


class Perturbation(Section, frozen=True, kw_only=True):
    """What is changed of the physics, or of what it tells; neither motion nor gate nor a learner is told."""

    name: Name
    lag_factor: Factor = 1.0
    """Times the servo's look-ahead and dead time."""
    braking_factor: Factor = 1.0
    """Times the deceleration of the arm's own stop."""
    payload_kg: Annotated[float, Meta(ge=-5.0, le=5.0)] = 0.0
    """Mass in the hand that weight compensation knows nothing of; negative: it counts on one that is absent."""
    kinematics_m: Length = 0.0
    """Added to the length of both arm links and of the tool."""
    tells_belief: bool = False
    """The controller tells the tool's place by the kinematics of the file, as a real one does; else the physics do."""
    mass_factor: Factor = 1.0
    """Times the mass of all that moves, arm and things; weight compensation counts on the masses of the files."""
    friction_factor: Factor = 1.0
    """Times the friction of every contact and every joint."""
    percept_m: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    """How far off things are perceived, base frame: the truth that is told is moved so, and the camera against it."""
