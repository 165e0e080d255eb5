"""Loads and checks config files, shipped by name or by a path of the user's own."""

from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import msgspec

from config.arm import ArmConfig
from config.cell import CellConfig
from config.checks import check_arm, check_cell, check_learning, check_rig, check_rules, check_scenario, check_sweep
from config.decode import decode
from config.errors import ConfigError
from config.learning import LearningConfig
from config.limit_checks import check_limits, check_limits_fit, check_parked, check_profile_named
from config.limited import limited
from config.limits import LimitsFile
from config.placing import check_fit, check_placing
from config.preset import grown
from config.resolved import Resolved
from config.rig import DEFAULT_LIMITS, Rig
from config.rules import RuleSet
from config.scenario import Scenario
from config.sources import Source, is_path, read_path, read_source
from config.sweep import Sweep
from config.wiring import check_cell_fits, check_reachable, check_wiring
from config.workspace import fenced
from config.yaml_text import Tree, parse_yaml

__all__ = [
    "load_arm",
    "load_cell",
    "load_learning",
    "load_limits",
    "load_resolved",
    "load_rig",
    "load_rules",
    "load_scenario",
    "load_sweep",
    "load_wired",
    "resolve",
    "with_rig",
]

S = TypeVar("S", bound=msgspec.Struct)
WHOLE_TICKS = 1e-6
KEPT = 64
"""Texts whose meaning is kept; a few times as many as are shipped."""


class _Files(msgspec.Struct, frozen=True, kw_only=True):
    """What errors call the files that a Resolved came from."""

    rig: str
    arm: str
    scenario: str
    rule_sets: tuple[str, ...]
    learning: str
    limits: str
    cell: str = "cell"


def load_arm(name: str | Path, *, base: Path | None = None) -> ArmConfig:
    """Return an arm: `ur5e`, or a path, relative ones starting from base."""
    return _load_arm(read_source("arms", name, base=base))


def load_cell(name: str | Path, *, base: Path | None = None) -> CellConfig:
    """Return how a control box is wired: `ur_box`, or a path, relative ones starting from base."""
    return _load_cell(read_source("cells", name, base=base))


def load_rig(name: str | Path) -> Rig:
    """Return a rig: `twin`, or a path. Its arm's file is not looked at."""
    return _load_rig(read_source("rigs", name))


def load_learning(name: str | Path) -> LearningConfig:
    """Return a learner's preset: `default`, `paper`, `group`, ... (config/learning), or a path."""
    return _load_learning(read_source("learning", name))


def load_limits(name: str | Path, *, base: Path | None = None) -> LimitsFile:
    """Return a limits file: `ur5e_parallel_jaw_85`, or a path, relative ones starting from base."""
    return _load_limits(read_source("limits", name, base=base))


def load_rules(name: str | Path, *, base: Path | None = None) -> RuleSet:
    """Return a rule set: a shipped one's name, or a path, relative ones starting from base."""
    return _load_rules(read_source("rules", name, base=base))


def load_sweep(name: str | Path) -> Sweep:
    """Return a sweep: `paper`, or a path. The files it names are paths from where it lies; they are not looked at."""
    source = read_source("sweeps", name)
    sweep = _decode(source, Sweep)
    check_sweep(sweep, source.file)
    if source.folder is None:
        return sweep
    folder = source.folder.resolve()
    return msgspec.structs.replace(
        sweep,
        presets=tuple(_from(folder, preset) for preset in sweep.presets),
        scenarios=tuple(_from(folder, scenario) for scenario in sweep.scenarios),
        rigs=tuple(_from(folder, rig) for rig in sweep.rigs),
    )


def load_scenario(name: str | Path) -> Scenario:
    """Return a scenario: `paper`, `workshop`, or a path. Its rule sets are checked too."""
    return load_wired(name)[0]


def load_wired(name: str | Path) -> tuple[Scenario, tuple[RuleSet, ...]]:
    """Return a scenario and the rule sets of its schedule, in its order."""
    scenario, rule_sets, _, _ = _load_wired(name)
    return scenario, rule_sets


def resolve(*, rig: str | Path = "twin", scenario: str | Path = "paper", learning: str | Path = "default") -> Resolved:
    """Return everything that a run is made of, checked together.

    Raises:
        ConfigError: a file is missing or wrong, or the files do not fit one another.
    """
    rig_source = read_source("rigs", rig)
    loaded_rig = _load_rig(rig_source)
    arm_source = read_source("arms", loaded_rig.arm, base=rig_source.folder)
    loaded_scenario, rule_sets, scenario_file, rule_files = _load_wired(scenario)
    learning_source = read_source("learning", learning)
    limits_source = _named_by(rig_source, "limits", "limits", loaded_rig.limits)
    resolved = Resolved(
        rig=loaded_rig,
        arm=fenced(_load_arm(arm_source), loaded_scenario, scenario_file),
        scenario=loaded_scenario,
        rule_sets=rule_sets,
        learning=_load_learning(learning_source),
        limits=_load_limits(limits_source),
        cell=_cell_of(loaded_rig, rig_source),
    )
    files = _Files(
        rig=rig_source.file,
        arm=arm_source.file,
        scenario=scenario_file,
        rule_sets=rule_files,
        learning=learning_source.file,
        limits=limits_source.file,
        cell=_cell_file(loaded_rig, rig_source),
    )
    _check_together(resolved, files)
    return resolved


def with_rig(resolved: Resolved, rig: str | Path) -> Resolved:
    """Return the same with another rig of the same arm.

    Raises:
        ConfigError: the rig's file is missing or wrong, or it is another arm's.
    """
    source = read_source("rigs", rig)
    loaded = _load_rig(source)
    arm = fenced(_load_arm(read_source("arms", loaded.arm, base=source.folder)), resolved.scenario, "scenario")
    if arm != resolved.arm:
        raise ConfigError(source.file, "arm", f"the arm that was used before, {resolved.arm.name}", repr(loaded.arm))
    limits_source = _named_by(source, "limits", "limits", loaded.limits)
    limits = _load_limits(limits_source)
    changed = msgspec.structs.replace(resolved, rig=loaded, limits=limits, cell=_cell_of(loaded, source))
    n = len(changed.rule_sets)
    names = _Files(
        rig=source.file,
        arm=source.file,
        scenario="scenario",
        rule_sets=("rules",) * n,
        learning="learning",
        limits=limits_source.file,
        cell=_cell_file(loaded, source),
    )
    _check_together(changed, names)
    return changed


def load_resolved(path: Path) -> Resolved:
    """Return what dump_resolved wrote, such as the config of a run folder, checked as if it came from its files."""
    source = read_path(path)
    resolved = decode(_with_limits(parse_yaml(source.text, source.file)), Resolved, source.file)
    n_spans, n_sets = len(resolved.scenario.schedule), len(resolved.rule_sets)
    if n_spans != n_sets:
        raise ConfigError(source.file, "rule_sets", f"{n_spans}, one for each span of the schedule", f"{n_sets}")
    files = _Files(
        rig=f"{source.file}: rig",
        arm=f"{source.file}: arm",
        scenario=f"{source.file}: scenario",
        rule_sets=tuple(f"{source.file}: rule_sets[{i}]" for i in range(n_sets)),
        learning=f"{source.file}: learning",
        limits=f"{source.file}: limits",
        cell=f"{source.file}: cell",
    )
    if resolved.cell is not None:
        check_cell(resolved.cell, files.cell)
    check_rig(resolved.rig, files.rig)
    check_arm(resolved.arm, files.arm)
    check_learning(resolved.learning, files.learning)
    check_limits(resolved.limits, files.limits)
    check_scenario(resolved.scenario, files.scenario)
    check_placing(resolved.scenario, files.scenario)
    _check_rule_sets(resolved.scenario, resolved.rule_sets, files.scenario, files.rule_sets)
    resolved = msgspec.structs.replace(resolved, arm=fenced(resolved.arm, resolved.scenario, files.scenario))
    _check_together(resolved, files)
    return resolved


def _load_arm(source: Source) -> ArmConfig:
    arm = _decode(source, ArmConfig)
    check_arm(arm, source.file)
    return arm


def _load_cell(source: Source) -> CellConfig:
    cell = _decode(source, CellConfig)
    check_cell(cell, source.file)
    return cell


def _cell_of(rig: Rig, source: Source) -> CellConfig | None:
    """Return the cell that a rig's file names, None where it names none."""
    return None if rig.cell is None else _load_cell(_named_by(source, "cell", "cells", rig.cell))


def _cell_file(rig: Rig, source: Source) -> str:
    return "cell" if rig.cell is None else _named_by(source, "cell", "cells", rig.cell).file


def _named_by(rig: Source, key: str, folder: str, name: str) -> Source:
    """Return what a rig's key names; a name that leads nowhere is an error of the rig's file."""
    try:
        return read_source(folder, name, base=rig.folder)
    except ConfigError as error:
        raise ConfigError(rig.file, key, error.expected, f"{error.got} ({error.file})") from error


def _load_rig(source: Source) -> Rig:
    rig = _decode(source, Rig)
    check_rig(rig, source.file)
    if source.folder is None:
        return rig
    folder = source.folder.resolve()
    if rig.keys is not None:
        rig = msgspec.structs.replace(rig, keys=str(folder / Path(rig.keys).expanduser()))
    if rig.camera is None:
        return rig
    calibration, colours = (_from(folder, name) for name in (rig.camera.calibration, rig.camera.colours))
    device = _from(folder, rig.camera.device)
    camera = msgspec.structs.replace(rig.camera, calibration=calibration, colours=colours, device=device)
    return msgspec.structs.replace(rig, camera=camera)


def _from(folder: Path, name: str) -> str:
    """Return a path that a file in a folder names, from anywhere; a shipped file's name as it is."""
    return str(folder / Path(name).expanduser()) if is_path(name) else name


def _load_learning(source: Source) -> LearningConfig:
    return _shipped_learning(source) if source.folder is None else _read_learning(source)


@lru_cache(maxsize=KEPT)
def _shipped_learning(source: Source) -> LearningConfig:
    return _read_learning(source)


def _read_learning(source: Source) -> LearningConfig:
    whole, told = grown(source)
    for tree, file in told:
        decode(tree, LearningConfig, file)  # a mistake is one of the file that it is in
    learning = decode(whole, LearningConfig, source.file)
    check_learning(learning, source.file)
    return learning


def _load_limits(source: Source) -> LimitsFile:
    limits = _decode(source, LimitsFile)
    check_limits(limits, source.file)
    return limits


def _with_limits(tree: Tree) -> Tree:
    """Return the tree of a Resolved with the limits of its rig's default, where it is from before there were any."""
    rig = tree.get("rig") if isinstance(tree, dict) else None
    if isinstance(tree, dict) and isinstance(rig, dict) and "limits" not in tree and "limits" not in rig:
        return tree | {"limits": msgspec.to_builtins(load_limits(DEFAULT_LIMITS))}
    return tree


def _load_rules(source: Source) -> RuleSet:
    rules = _decode(source, RuleSet)
    check_rules(rules, source.file)
    return rules


def _load_wired(name: str | Path) -> tuple[Scenario, tuple[RuleSet, ...], str, tuple[str, ...]]:
    source = read_source("scenarios", name)
    scenario = _decode(source, Scenario)
    check_scenario(scenario, source.file)
    check_placing(scenario, source.file)
    sources = [_rules_source(span.rules, i, source) for i, span in enumerate(scenario.schedule)]
    rule_sets = tuple(_load_rules(rules_source) for rules_source in sources)
    files = tuple(rules_source.file for rules_source in sources)
    _check_rule_sets(scenario, rule_sets, source.file, files)
    return scenario, rule_sets, source.file, files


def _rules_source(name: str, i: int, scenario: Source) -> Source:
    """Return a schedule's rule set; a name that leads nowhere is an error of the scenario's file."""
    try:
        return read_source("rules", name, base=scenario.folder)
    except ConfigError as error:
        raise ConfigError(
            scenario.file, f"schedule[{i}].rules", error.expected, f"{error.got} ({error.file})"
        ) from error


def _check_rule_sets(
    scenario: Scenario, rule_sets: tuple[RuleSet, ...], scenario_file: str, files: tuple[str, ...]
) -> None:
    for i, (rules, file) in enumerate(zip(rule_sets, files, strict=True)):
        check_rules(rules, file)
        check_wiring(scenario, rules, file)
        check_reachable(scenario, rules, f"schedule[{i}].rules", scenario_file)


def _check_together(resolved: Resolved, files: _Files) -> None:
    """Check rig against arm, and scenario against arm."""
    rig, arm = resolved.rig, resolved.arm
    if rig.expected.model != arm.name:
        raise ConfigError(
            files.rig,
            "expected.model",
            f"{arm.name}, the model that the arm's file describes",
            repr(rig.expected.model),
        )
    n_ticks = arm.motion.step_s / rig.tick_s
    if n_ticks < 0.5 or abs(n_ticks - round(n_ticks)) > WHOLE_TICKS:
        raise ConfigError(
            files.arm, "motion.step_s", f"whole ticks of the rig's {rig.tick_s:g} s", f"{arm.motion.step_s:g}"
        )
    check_profile_named(resolved.limits, rig.profile, files.rig)
    check_limits_fit(resolved.limits, arm, resolved.scenario, files.limits)
    if rig.parked_rad is not None:
        check_parked(resolved.profile, arm, rig.parked_rad, files.rig)
    check_fit(resolved.scenario, limited(arm, resolved.profile), files.scenario)
    if resolved.cell is not None:
        check_cell_fits(resolved.scenario, resolved.cell, files.cell)


def _decode(source: Source, kind: type[S]) -> S:
    decoded = _decoded(source, kind)
    assert isinstance(decoded, kind)
    return decoded


@lru_cache(maxsize=KEPT)
def _decoded(source: Source, kind: type[msgspec.Struct]) -> msgspec.Struct:
    """Return what a text says. It is read again for every rig that names it, and takes 10 ms each time."""
    return decode(parse_yaml(source.text, source.file), kind, source.file)
