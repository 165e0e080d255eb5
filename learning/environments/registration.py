"""The ids of scenes: each shipped scenario by its name, and `scene`, whose scenario is named or a path."""

from typing import Any

import gymnasium
from gymnasium.wrappers import FlattenObservation

from config.sources import shipped_names
from learning.environments.scene import SceneEnv

__all__ = ["ANY_SCENE", "NAMESPACE", "make_flat", "make_goal", "register_scenes", "scene_id"]

NAMESPACE, ANY_SCENE = "autotelic", "scene"
GOAL, FLAT = "goal", "flat"
VERSION = 0


def scene_id(name: str, *, is_flat: bool) -> str:
    """Return the id of a scene: `autotelic/NAME-goal-v0` with dict observations, `-flat-v0` with one row."""
    return f"{NAMESPACE}/{name}-{FLAT if is_flat else GOAL}-v{VERSION}"


def register_scenes() -> None:
    """Register every shipped scenario, and `scene` for a scenario of one's own. Twice is as good as once."""
    for name in (*shipped_names("scenarios"), ANY_SCENE):
        given = {} if name == ANY_SCENE else {"scenario": name}
        for is_flat, entry_point in ((False, "make_goal"), (True, "make_flat")):
            if (known := scene_id(name, is_flat=is_flat)) not in gymnasium.registry:
                gymnasium.register(known, entry_point=f"{__name__}:{entry_point}", kwargs=given)


def make_goal(**given: Any) -> gymnasium.Env:  # noqa: ANN401 - whatever SceneEnv takes
    """Return a scene with dict observations."""
    return SceneEnv(**given)


def make_flat(**given: Any) -> gymnasium.Env:  # noqa: ANN401 - whatever SceneEnv takes
    """Return a scene with one row of numbers: goals achieved, the goal wanted, what is observed."""
    return FlattenObservation(SceneEnv(**given))
