"""Trials by the wall clock that are judged, or, where this machine was overbooked in every try, told as not judged."""

import pytest

from sim_twin.broken import DisturbedError
from tests.support.overbooked import OVERBOOKED_SHARE, Overbooked

__all__ = ["JudgedCourse"]

N_TRIES, LEAST_JUDGED = 3, 0.75


class JudgedCourse:
    """A course, and which of its faults came to a verdict."""

    def __init__(self, course, wrong_with):
        self.course, self.tried, self.judged = course, [], []
        self._wrong_with = wrong_with
        self._whole = Overbooked()

    def run(self, trial):
        """Return an outcome that is as asked; fail at the first that is not on a machine that was not overbooked."""
        self.tried.append(trial.name)
        told = []
        while len(told) < N_TRIES:
            overbooked = Overbooked()
            outcome, wrong = self._outcome(trial)
            if not wrong:
                self.judged.append(trial.name)
                return outcome
            share = overbooked.share()
            told.append(f"{wrong} (somebody waited for a processor {share:.0%} of the time)")
            if share < OVERBOOKED_SHARE:
                self.judged.append(trial.name)
                pytest.fail(f"{trial.name}: {'; '.join(told)}")
            if outcome is None:
                break  # a course that is disturbed has begun anew often enough by itself
        pytest.skip(f"{trial.name} was not judged, this machine was overbooked: {'; '.join(told)}")

    def _outcome(self, trial):
        """Return what came of one try, and what was wrong with it."""
        try:
            outcome = self.course.run(trial)
        except DisturbedError as error:
            return None, str(error)
        wrong = self._wrong_with(trial, outcome)
        return outcome, f"{wrong}, {outcome.details()}" if wrong else ""

    def close(self):
        """Fail where too little was judged."""
        share = self._whole.share()
        least = LEAST_JUDGED * len(self.tried) if share < OVERBOOKED_SHARE else min(1, len(self.tried))
        unjudged = [name for name in self.tried if name not in self.judged]
        if len(self.judged) < least:
            pytest.fail(
                f"only {len(self.judged)} of {len(self.tried)} faults were judged, not {', '.join(unjudged)}; "
                f"somebody waited for a processor {share:.0%} of the time"
            )
