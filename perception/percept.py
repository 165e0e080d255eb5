"""The perception door: measurements in, percept out."""

from typing import Protocol

from robot.messages import ArmState, Percept, SceneState

__all__ = ["Perception"]


class Perception(Protocol):
    """Derives the percept from what was measured."""

    def perceive(self, arm: ArmState, scene: SceneState | None) -> Percept:
        """Return P(t), object poses and grip at the arm's stamp."""
        ...
