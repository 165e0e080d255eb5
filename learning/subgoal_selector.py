"""The sub-goal selector: which goal to try next on the way to the wanted one, once a trial.

Implementations of one protocol (learning/interfaces.py), chosen by name in the config:

* `q`: Q-learning over goal-states, as the paper has it;
* `q_hindsight`: the same, learning about every goal from each trial, with replay;
* `graph`: a posterior over each goal's preconditions, and a plan;
* `direct`, `mdp`, `q_drop`: what is found elsewhere, to compare with (learning/subgoal_baselines.py).
"""

from importlib import import_module

import numpy as np

from config.learning import SubgoalSelection
from learning.interfaces import SubgoalSelector

__all__ = ["SELECTORS", "make_subgoal_selector"]

SELECTORS = {
    "q": "learning.subgoal_q:QSelector",
    "q_hindsight": "learning.subgoal_q:QHindsightSelector",
    "q_drop": "learning.subgoal_baselines:DropSelector",
    "mdp": "learning.subgoal_baselines:MdpSelector",
    "direct": "learning.subgoal_baselines:DirectSelector",
    "graph": "learning.subgoal_graph:GraphSelector",
}


def make_subgoal_selector(*, n_goals: int, config: SubgoalSelection, rng: np.random.Generator) -> SubgoalSelector:
    """Return the sub-goal selector that the config names."""
    module, name = SELECTORS[config.kind].split(":")
    return getattr(import_module(module), name)(n_goals=n_goals, config=config, rng=rng)
