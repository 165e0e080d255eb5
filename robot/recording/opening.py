"""Where an account can be lived through from: what the learner was at an epoch's boundary, and on what rig."""

import msgspec

from robot.bus.topic import Role, Topic
from robot.messages import StationSpec

__all__ = ["OPENING", "Opening"]


class Opening(msgspec.Struct, frozen=True, kw_only=True):
    """What a session's file needs at its beginning to be replayed alone."""

    seed: int
    """Root seed of the run."""
    n_done: int
    """Epochs done before."""
    learner: str
    config: str
    """Everything the run is made of, as YAML."""
    spec: StationSpec
    state: str
    """The learner's state, a ZIP archive in base 64."""


OPENING = Topic(name="account/opening", kind=Opening, writers=(Role.LEARNING,))
"""In an account; a recorder begins a file with it."""
