"""A fit as files: the arm's with what was fitted, a rig of the twin that names it, the page, and all of it as JSON."""

from pathlib import Path

import msgspec

from config.arm import ArmConfig
from config.errors import ConfigError
from config.loader import load_arm, load_rig
from config.resolved import Resolved
from config.workspace import fenced
from config.yaml_text import dump_yaml
from robot.errors import RobotConfigError
from sim_twin.fitting.fit import Fit

__all__ = ["ARM", "PAGE", "RIG", "check_new", "write_fit"]

ARM, RIG, PAGE, NUMBERS = "arm.yaml", "rig.yaml", "report.html", "fit.json"


def check_new(folder: Path) -> None:
    """Refuse a folder that has a fit already, before one is made.

    Raises:
        RobotConfigError: it has.
    """
    there = [name for name in (ARM, RIG, PAGE, NUMBERS) if (folder / name).exists()]
    if there:
        raise RobotConfigError(f"{folder / there[0]}: expected a folder without a fit; give another with --out")


def write_fit(folder: Path, fit: Fit, resolved: Resolved, page: str) -> None:
    """Write them.

    Raises:
        RobotConfigError: the folder cannot be written, or has a fit already.
    """
    arm = msgspec.structs.replace(_as_in_its_file(resolved), fitted=fit.plant)
    rig = msgspec.structs.replace(
        load_rig("twin"), name="twin_fitted", arm=f"./{ARM}", profile=resolved.rig.profile, limits=resolved.rig.limits,
        description=f"The twin of {fit.model} {fit.serial}, fitted to its sessions.",
    )  # fmt: skip
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in (
            (ARM, dump_yaml(msgspec.to_builtins(arm))),
            (RIG, dump_yaml(msgspec.to_builtins(rig))),
            (PAGE, page),
            (NUMBERS, msgspec.json.format(msgspec.json.encode(fit), indent=1).decode()),
        ):
            with (folder / name).open("x", encoding="utf-8") as file:
                file.write(text)
    except OSError as error:
        raise RobotConfigError(
            f"{folder}: expected a folder to write a new fit to, {error.strerror or error}; give another with --out"
        ) from error


def _as_in_its_file(resolved: Resolved) -> ArmConfig:
    """Return the arm without what a scenario fences of it, where its file is here and still the same."""
    try:
        arm = load_arm(resolved.rig.arm)
    except ConfigError:
        return resolved.arm
    return arm if fenced(arm, resolved.scenario, "scenario") == resolved.arm else resolved.arm
