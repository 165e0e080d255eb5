"""What can be known of a table whose rules were drawn, and are drawn anew at a hazard: Bayes' rule over rule sets.

Given the epoch since which the rules are in force, what one goal needs tells nothing of what another needs, and a trial
tells of one goal alone. So the posterior over rule sets is a mixture, over that epoch, of products over goals, and it
is kept whole: every conjunction of every goal under every epoch (after Adams and MacKay, "Bayesian online changepoint
detection", 2007). It leaves out two things: a mixed part that is lighter than 1e-30 of the heaviest, and that tables on
which some goal cannot be achieved are never laid out.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from learning.preconditions import Needs

__all__ = ["RuleBelief"]

FAINTEST = float(np.log(1e-30))


class RuleBelief:
    """The posterior over rule sets and over how long they have been in force.

    Args:
        prior: for each goal how probable each of its conjunctions is when rules are drawn; as many for every goal.
        hazard: chance that rules are drawn anew before an epoch.
    """

    def __init__(self, prior: Sequence[Mapping[Needs, float]], *, hazard: float) -> None:
        self._index = [{needs: h for h, needs in enumerate(chances)} for chances in prior]
        self._on = np.array([[needs.on for needs in chances] for chances in prior], dtype=np.int64)  # (n, h)
        self._off = np.array([[needs.off for needs in chances] for chances in prior], dtype=np.int64)  # (n, h)
        self._prior = np.array([list(chances.values()) for chances in prior])[None]  # (1, n, h)
        self._hazard = hazard
        self._chances = self._prior.copy()
        """[r, g, h]: how probable conjunction h of goal g is, given that rules are in force since epoch r."""
        self._log_weights = np.zeros(1)
        """[r]: the logarithm of how probable that is, less that of the heaviest."""
        self._marginals: np.ndarray | None = None

    @property
    def n_goals(self) -> int:
        """How many goals there are."""
        return len(self._on)

    def begin_epoch(self) -> None:
        """Take the rules to have been drawn anew, at the hazard."""
        if self._hazard == 0.0:
            return
        whole = np.logaddexp.reduce(self._log_weights)
        kept = self._log_weights + np.log1p(-self._hazard)
        self._log_weights = np.append(kept, whole + np.log(self._hazard))
        self._chances = np.concatenate([self._chances, self._prior])
        self._marginals = None

    def update(self, goal: int, state: int, *, if_allowed: float, if_not: float) -> None:
        """Apply Bayes' rule to what came of a trial.

        Args:
            goal: what was tried, or came about.
            state: goal-state before it, as a bit mask.
            if_allowed: chance of what came where the goal is allowed there.
            if_not: the same where it is not.

        Raises:
            ValueError: no rules that can be drawn would let that come.
        """
        likelihood = np.where(self.allows(goal, np.array([state]))[:, 0], if_allowed, if_not)  # (h,)
        evidence = self._chances[:, goal] @ likelihood  # (r,)
        if not evidence.any():
            raise ValueError(f"expected what rules of the class allow, came goal {goal} in state {state:b}")
        with np.errstate(divide="ignore"):
            weights = self._log_weights + np.log(evidence)
        weights -= weights.max()
        is_kept = weights > FAINTEST
        self._log_weights = weights[is_kept]
        self._chances = self._chances[is_kept]
        self._chances[:, goal] *= likelihood / evidence[is_kept, None]
        self._marginals = None

    def allows(self, goal: int, states: np.ndarray) -> np.ndarray:
        """Return which conjunctions allow a goal in goal-states, bit masks.  (s,) -> (h, s)"""
        on, off = self._on[goal][:, None], self._off[goal][:, None]
        return ((on & ~states) | (off & states)) == 0

    def marginals(self) -> np.ndarray:
        """Return how probable each conjunction of each goal is, however long in force.  () -> (n, h)"""
        if self._marginals is None:
            self._marginals = np.tensordot(self._weights(), self._chances, axes=1)
        return self._marginals

    def chance_of(self, rules: Sequence[Needs]) -> float:
        """Return how probable a whole rule set is."""
        at = [index[needs] for index, needs in zip(self._index, rules, strict=True)]
        return float(self._weights() @ self._chances[:, np.arange(self.n_goals), at].prod(axis=1))

    def _weights(self) -> np.ndarray:
        weights = np.exp(self._log_weights)
        return weights / weights.sum()

    def state_dict(self) -> dict[str, Any]:
        """Return the posterior."""
        return {"chances": self._chances.copy(), "log_weights": self._log_weights.copy()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._chances, self._log_weights = np.array(state["chances"]), np.array(state["log_weights"])
        self._marginals = None
