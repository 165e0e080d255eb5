"""Scenes as Gymnasium environments: `gymnasium.make("learning.environments:autotelic/paper-goal-v0")`.

Importing this registers them, as Gymnasium asks of a package with environments. Needs the extra `gym`.
"""

from learning.environments.registration import register_scenes
from learning.environments.scene import SceneEnv

__all__ = ["SceneEnv"]

register_scenes()
