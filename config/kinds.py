"""Which kind of config a file is, told from its keys, and what checks a file of each kind."""

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path

from config.arm import ArmConfig
from config.cell import CellConfig
from config.errors import ConfigError
from config.learning import LearningConfig
from config.limits import LimitsFile
from config.loader import (
    load_arm,
    load_cell,
    load_learning,
    load_limits,
    load_resolved,
    load_rig,
    load_rules,
    load_sweep,
    load_wired,
)
from config.resolved import Resolved
from config.rig import Rig
from config.rules import RuleSet
from config.scenario import Scenario
from config.sources import read_path
from config.sweep import Sweep
from config.values import Section
from config.yaml_text import parse_yaml, shown

__all__ = ["Kind", "check_file", "kind_of"]


class Kind(StrEnum):
    """The kinds of config files."""

    ARM = "arm"
    CELL = "cell"
    LEARNING = "learning"
    LIMITS = "limits"
    RESOLVED = "resolved"
    RIG = "rig"
    RULES = "rules"
    SCENARIO = "scenario"
    SWEEP = "sweep"


COMMON_KEYS = ("name", "description")
STRUCTS: dict[Kind, type[Section]] = {
    Kind.ARM: ArmConfig,
    Kind.CELL: CellConfig,
    Kind.LEARNING: LearningConfig,
    Kind.LIMITS: LimitsFile,
    Kind.RESOLVED: Resolved,
    Kind.RIG: Rig,
    Kind.RULES: RuleSet,
    Kind.SCENARIO: Scenario,
    Kind.SWEEP: Sweep,
}
LOADERS: dict[Kind, Callable[[Path], object]] = {
    Kind.ARM: load_arm,
    Kind.CELL: load_cell,
    Kind.LEARNING: load_learning,
    Kind.LIMITS: load_limits,
    Kind.RESOLVED: load_resolved,
    Kind.RIG: load_rig,
    Kind.RULES: load_rules,
    Kind.SCENARIO: load_wired,
    Kind.SWEEP: load_sweep,
}


def check_file(path: Path, kind: Kind | None = None) -> Kind:
    """Load a file of that kind, or of the kind that its keys tell, and return the kind.

    Raises:
        ConfigError: the file is wrong, or its keys do not tell what it is.
    """
    found = kind_of(path) if kind is None else kind
    LOADERS[found](path)
    return found


def kind_of(path: Path) -> Kind:
    """Return the kind that has most of a file's top-level keys to itself."""
    source = read_path(path)
    tree = parse_yaml(source.text, source.file)
    if not isinstance(tree, dict):
        raise ConfigError(source.file, "", "a mapping", shown(tree))
    n_keys = {kind: len(tree.keys() & (_keys(struct) - set(COMMON_KEYS))) for kind, struct in STRUCTS.items()}
    most = max(n_keys.values())
    best = [kind for kind, n in n_keys.items() if n == most]
    if most == 0 or len(best) > 1:
        raise ConfigError(
            source.file, "", "keys that tell the kind of file, or --kind", ", ".join(map(shown, tree)) or "none"
        )
    return best[0]


def _keys(struct: type[Section]) -> set[str]:
    return set(struct.__struct_fields__)
