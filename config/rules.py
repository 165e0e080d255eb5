"""Rule sets of the cell: which latched inputs switch which outputs."""

from config.values import Name, Section

__all__ = ["Literal", "Rule", "RuleSet"]


class Literal(Section, frozen=True, kw_only=True):
    """A latched cell input that must be on (or off)."""

    input: Name
    is_on: bool


class Rule(Section, frozen=True, kw_only=True):
    """An output is on exactly while every literal holds; no literal means always on."""

    output: Name
    when: tuple[Literal, ...] = ()


class RuleSet(Section, frozen=True, kw_only=True):
    """The rules in force for a span of epochs, one for each lid output of the scenario."""

    name: Name
    description: str = ""
    rules: tuple[Rule, ...]
