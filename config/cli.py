"""`autotelic config`: check files, show what a run would be made of."""

from pathlib import Path
from typing import Annotated

import typer

from config.errors import ConfigError
from config.kinds import Kind, check_file
from config.loader import (
    load_arm,
    load_cell,
    load_learning,
    load_limits,
    load_rig,
    load_rules,
    load_sweep,
    load_wired,
    resolve,
)
from config.resolved import dump_resolved
from config.sources import shipped_names

__all__ = ["app"]

EXIT_CONFIG = 2
SHIPPED = {
    "arms": load_arm,
    "cells": load_cell,
    "learning": load_learning,
    "limits": load_limits,
    "rigs": load_rig,
    "rules": load_rules,
    "scenarios": load_wired,
    "sweeps": load_sweep,
}

app = typer.Typer(no_args_is_help=True, help="Check and show config files.")


@app.command()
def check(
    files: Annotated[list[Path] | None, typer.Argument(help="Files to check; all the shipped ones if none.")] = None,
    kind: Annotated[Kind | None, typer.Option(help="What the files are, where their keys do not tell.")] = None,
    rig: Annotated[str, typer.Option(help="Rig whose arm a scenario must fit.")] = "twin",
) -> None:
    """Check files: `ok` or one line that says what is wrong; exit code 2 if one is."""
    n_wrong = 0 if files else _check_shipped(rig)
    for path in files or ():
        try:
            found = check_file(path, kind)
            if found is Kind.SCENARIO:
                resolve(rig=rig, scenario=path)
            elif found is Kind.RIG:
                resolve(rig=path)
        except ConfigError as error:
            typer.echo(f"error: {error}", err=True)
            n_wrong += 1
        else:
            typer.echo(f"ok: {path} ({found.value})")
    if n_wrong:
        raise typer.Exit(EXIT_CONFIG)


@app.command()
def show(
    scenario: Annotated[str, typer.Option(help="A shipped scenario's name or a path.")] = "paper",
    rig: Annotated[str, typer.Option(help="A shipped rig's name or a path.")] = "twin",
    preset: Annotated[str, typer.Option(help="A shipped learning preset's name or a path.")] = "default",
) -> None:
    """Print, as YAML, everything that a run of these would be made of, defaults filled in."""
    try:
        resolved = resolve(rig=rig, scenario=scenario, learning=preset)
    except ConfigError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(EXIT_CONFIG) from error
    typer.echo(dump_resolved(resolved), nl=False)


def _check_shipped(rig: str) -> int:
    """Check every shipped file, print a line for each and return how many are wrong."""
    n_wrong = 0
    for folder, load in SHIPPED.items():
        for name in shipped_names(folder):
            try:
                load(name)
                if folder == "scenarios":
                    resolve(rig=rig, scenario=name)
            except ConfigError as error:
                typer.echo(f"error: {error}", err=True)
                n_wrong += 1
            else:
                typer.echo(f"ok: {folder}/{name}.yaml")
    return n_wrong
