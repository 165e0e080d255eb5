"""Everything a run is made of, in one Struct and one file."""

import msgspec

from config.arm import ArmConfig
from config.cell import CellConfig
from config.learning import LearningConfig
from config.limits import LimitsFile, Profile
from config.rig import Rig
from config.rules import RuleSet
from config.scenario import Scenario
from config.values import Section
from config.yaml_text import dump_yaml

__all__ = ["Resolved", "dump_resolved"]


class Resolved(Section, frozen=True, kw_only=True):
    """A rig with its arm, a scenario with its rule sets, and a learner."""

    rig: Rig
    arm: ArmConfig
    scenario: Scenario
    rule_sets: tuple[RuleSet, ...]
    """The i-th is in force from scenario.schedule[i].from_epoch."""
    learning: LearningConfig
    limits: LimitsFile
    cell: CellConfig | None = None
    """How the rig's control box is wired; None is straight through."""

    @property
    def profile(self) -> Profile:
        """The limits that the rig holds."""
        found = self.limits.profile(self.rig.profile)
        assert found is not None, "config.limit_checks saw to it"
        return found

    def rules_at(self, epoch: int) -> RuleSet:
        """Return the rule set in force in an epoch."""
        in_force = [i for i, span in enumerate(self.scenario.schedule) if span.from_epoch <= epoch]
        return self.rule_sets[in_force[-1]]


def dump_resolved(resolved: Resolved) -> str:
    """Return YAML text that config.loader.load_resolved reads back to an equal Resolved."""
    return dump_yaml(msgspec.to_builtins(resolved))
