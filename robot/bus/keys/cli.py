"""`autotelic keys`: certificates for the processes of a rig whose bus leaves this machine. The edge."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from robot.bus.keys.keyring import Keyring
from robot.bus.topic import Role

__all__ = ["app"]

app = typer.Typer(no_args_is_help=True, help="Certificates for a bus that leaves this machine.")

KeysOption = Annotated[Path, typer.Option("--keys", help="Folder of the keys.")]
KEYS = Path("keys")


@app.command()
def init(keys: KeysOption = KEYS) -> None:
    """Make an authority. Whoever has its key can make certificates: keep KEYS/authority/key.pem on one machine."""
    ledger = Keyring(keys).init(now=datetime.now(UTC))
    typer.echo(f"{ledger.authority}: {keys}. Next, for the hub: `autotelic keys issue ROLE --host ADDRESS`")


@app.command()
def issue(
    role: Annotated[Role, typer.Argument(help="What the process is for; it decides what it may write.")],
    source: Annotated[str, typer.Option(help="Its name, where there are several of a role.")] = "",
    host: Annotated[list[str] | None, typer.Option(help="The hub's: an address or name it listens at.")] = None,
    days: Annotated[int, typer.Option(min=1, max=3650, help="For how long.")] = 365,
    keys: KeysOption = KEYS,
) -> None:
    """Make a certificate for one process."""
    entry = Keyring(keys).issue(role, source=source, hosts=tuple(host or ()), days=days, now=datetime.now(UTC))
    where = keys / entry.source
    typer.echo(
        f"{entry.name}: {where}, until {entry.expires:%Y-%m-%d}. To its machine: {keys / 'authority.pem'} and {where}. "
        "Start the hub anew, with this ledger: it reads who may come in when it starts"
    )


@app.command()
def revoke(
    name: Annotated[str, typer.Argument(help="Of the certificate, as `keys list` shows it.")], keys: KeysOption = KEYS
) -> None:
    """Take a certificate back. It holds from the hub's next start."""
    Keyring(keys).revoke(name, now=datetime.now(UTC))
    typer.echo(f"{name} is revoked: start the hub anew, with this ledger")


@app.command(name="list")
def show(keys: KeysOption = KEYS, *, json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """List what was issued, and what became of it."""
    ledger, now = Keyring(keys).ledger(), datetime.now(UTC)
    if json:
        typer.echo(msgspec.json.encode(ledger).decode())
        return
    table = Table("name", "role", "source", "listens at", "until", "state", title=escape(ledger.authority))
    for entry in ledger.entries:
        state = entry.state_at(now)
        table.add_row(
            entry.name, entry.role, entry.source, escape(", ".join(entry.hosts)), f"{entry.expires:%Y-%m-%d}", state,
            style=None if state == "valid" else "dim",
        )  # fmt: skip
    Console().print(table)
