"""Agents of stable-baselines3 on a scene: what one network reaches without our layers. The edge; needs an extra.

`flat` is soft actor-critic on one row of numbers, the wanted goal among them; `her` is the same on dict observations,
with hindsight. Sizes and rates are the library's own, but for what is named here: they were not tuned.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.callbacks import BaseCallback

from learning.environments.registration import make_flat, make_goal

__all__ = ["AGENTS", "Agent"]

AGENTS = ("flat", "her")
LEARNING_STARTS = 1000
"""Time steps at random before anything is learnt: nearly two whole episodes, as hindsight asks for one that is over."""
GAMMA = 0.98
"""A success that is 50 time steps away still counts for a third."""
BUFFER_STEPS = 100_000
MODEL, BUFFER = "model.zip", "replay.pkl"


class _UntilAsked(BaseCallback):
    """Ends learning when a stop is asked for, and tells each time step."""

    def __init__(self, should_stop: Callable[[], bool], when_stepped: Callable[[], object]) -> None:
        super().__init__()
        self._should_stop, self._when_stepped = should_stop, when_stepped

    def _on_step(self) -> bool:
        self._when_stepped()
        return not self._should_stop()


class Agent:
    """One learner of the library, the scene it learns on, and another like it that it is tested on.

    Args:
        kind: one of AGENTS.
        scene: what the scene takes.
        seed: of the agent and of the scene.
    """

    def __init__(self, kind: str, scene: dict[str, Any], *, seed: int) -> None:
        torch.set_num_threads(1)  # small networks: more threads cost more than they bring, and change the sums
        make = make_goal if kind == "her" else make_flat
        self._env, self._tested = make(**scene), make(**scene)
        settings: dict[str, Any] = {
            "learning_starts": LEARNING_STARTS, "buffer_size": BUFFER_STEPS, "gamma": GAMMA, "seed": seed,
            "device": "cpu",
        }  # fmt: skip
        if kind == "her":
            self._model = SAC("MultiInputPolicy", self._env, replay_buffer_class=HerReplayBuffer, **settings)
        else:
            self._model = SAC("MlpPolicy", self._env, **settings)

    def learn(self, n_steps: int, *, should_stop: Callable[[], bool], when_stepped: Callable[[], object]) -> None:
        """Learn for so many time steps more, or until a stop is asked for."""
        heard = _UntilAsked(should_stop, when_stepped)
        self._model.learn(n_steps, callback=heard, reset_num_timesteps=False)

    def test(self, goal: int, *, seed: int) -> tuple[bool, bool, int]:
        """Pursue a goal with learning off; return whether it came about, whether that was void, and the time steps."""
        seen, _ = self._tested.reset(seed=seed, options={"goal": goal})
        n_steps, is_over, info = 0, False, {}
        while not is_over:
            action, _ = self._model.predict(seen, deterministic=True)
            seen, _, terminated, truncated, info = self._tested.step(action)
            n_steps, is_over = n_steps + 1, terminated or truncated
        return bool(info["is_success"]), bool(info["is_void"]), n_steps

    def keep(self, folder: Path) -> None:
        """Write what was learnt and what it was learnt from."""
        self._model.save(folder / MODEL)
        self._model.save_replay_buffer(folder / BUFFER)

    def take_up(self, folder: Path, *, n_steps: int) -> None:
        """Go on from what was kept after so many time steps; what is drawn is not what an unbroken run would draw."""
        self._model.set_parameters(str(folder / MODEL))
        self._model.num_timesteps = n_steps
        self._model.load_replay_buffer(folder / BUFFER)

    def close(self) -> None:
        """Release the scenes."""
        self._env.close()
        self._tested.close()
