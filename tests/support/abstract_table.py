"""The paper's rules on a table without physics, and the seeds of its tests."""

from learning.abstract.rules import Rules, needs
from learning.abstract.table import Things

__all__ = ["PAPER_AFTER", "PAPER_BEFORE", "PAPER_THINGS", "REPORTING_SEEDS", "TUNING_SEEDS"]

TUNING_SEEDS = tuple(range(100, 116))
"""Seeds on which settings were chosen."""
REPORTING_SEEDS = tuple(range(10))
"""Seeds on which the figures in reports were measured, and that tests run on."""

PAPER_BEFORE: Rules = (needs(), needs(), needs(), needs([1]), needs([2]), needs([4]))
PAPER_AFTER: Rules = (needs(), needs(), needs(), needs(off=[1]), needs(off=[2]), needs([4, 0]))
PAPER_THINGS = Things(grabs=frozenset({3, 4}), carried=((5, 4),))
