"""`autotelic session`: look at recorded sessions, check, save, cut and merge them. The edge."""

from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.table import Table

from robot.errors import RobotConfigError
from robot.recording.checking import check as check_session
from robot.recording.checking import lines
from robot.recording.cutting import cut as cut_session
from robot.recording.cutting import epochs_span
from robot.recording.cutting import merge as merge_sessions
from robot.recording.errors import DamagedError
from robot.recording.recovering import recover as recover_session
from robot.recording.session_file import SessionFile
from robot.recording.telling import about_session
from robot.rigs import load
from robot.stdio import STDERR, redirected_stdout
from robot.stop_request import StopRequest

__all__ = ["app"]

EXIT_FAILED = 1
REPLAYERS = {
    "learning": "learning.replaying:replay_session",
    "twin": "robot.recording.replay_to_arm:replay_to_arm",
    "arm": "robot.recording.replay_to_wire:replay_to_wire",
    "bus": "robot.recording.replay_to_bus:replay_to_bus",
}
"""Who replays a session; learning is not known here."""
EXPORTERS = {
    "lerobot": "robot.recording.exporting.lerobot:export_lerobot",
    "minari": "robot.recording.exporting.minari_set:export_minari",
}
"""Loaded when asked for: they bring libraries of their own."""
VIEWER = "viewer"
MOST_LOST = 10

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Recorded sessions: look at them, check, recover, cut, merge, export, replay, draw.",
)
Session = Annotated[Path, typer.Argument(help="A session's file.")]
Out = Annotated[Path, typer.Option("--out", "-o", help="The new file; nothing is overwritten.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


@app.command()
def info(session: Session, *, json: Json = False) -> None:
    """Tell what a session is of, what it holds, and how large it is."""
    with SessionFile(session) as opened:
        told = about_session(opened)
    if json:
        typer.echo(msgspec.json.encode(told).decode())
        return
    console = Console()
    for key, value in told.about.items():
        console.print(f"{key}: {value}", highlight=False, markup=False)
    table = Table(
        "topic", "messages", "a second", "bytes each", title=f"{told.path}: {told.seconds:.1f} s, {told.size} B"
    )
    for stream in told.streams:
        table.add_row(stream.topic, str(stream.n), f"{stream.rate_hz:.1f}", f"{stream.bytes_each:.0f}")
    console.print(table)
    console.print("attached: " + ", ".join(f"{a.name} ({a.n_bytes} B)" for a in told.attached), markup=False)


@app.command()
def check(session: Session, *, json: Json = False) -> None:
    """Look for what is wrong with a session; exit code 1 if it is unfit to learn from or to replay.

    Gaps, stale, frozen and drifting streams, stamps that go back, duplicates, lost messages, missing attachments, types
    of another version, actions cut short more often than not, epochs without outcome.
    """
    try:
        with SessionFile(session) as opened:
            checked = check_session(opened)
    except DamagedError as error:
        if json:
            typer.echo(msgspec.json.encode({"path": str(session), "damaged": str(error)}).decode())
        else:
            typer.echo(f"error: {error}", err=True)
        raise typer.Exit(EXIT_FAILED) from error
    if json:
        typer.echo(msgspec.json.encode(checked).decode())
    else:
        for line in lines(checked):
            typer.echo(line)
    if not checked.is_sound:
        raise typer.Exit(EXIT_FAILED)


@app.command()
def export(
    sessions: Annotated[list[Path], typer.Argument(help="Sessions' files, into one data set.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Its folder, or its file; nothing is overwritten.")],
    *,
    to: Annotated[
        str,
        typer.Option(help="lerobot (LeRobotDataset v3.0), minari, or viewer (one MCAP file with Protocol Buffers)."),
    ] = "lerobot",
) -> None:
    """Write sessions as a data set that others' learners read (`pip install autotelic[export]`), or for a viewer."""
    if to == VIEWER and len(sessions) == 1:
        from robot.recording.viewer_file import write_viewer_file

        typer.echo(f"{out}: {write_viewer_file(sessions[0], out)}")
        return
    if to not in EXPORTERS:
        names = " or ".join([*EXPORTERS, f"{VIEWER}, of one session"])
        raise typer.BadParameter(f"expected {names}, came {to!r}", param_hint="--to")
    from robot.recording.exporting import courses_of

    try:
        exporter = load(EXPORTERS[to])
    except RobotConfigError as error:
        raise RobotConfigError(
            f"--to {to}: expected its libraries, `pip install autotelic[export]` brings them: {error.__cause__}"
        ) from error
    typer.echo(f"{out}: {exporter(courses_of(sessions), out)}")


@app.command()
def record(
    out: Out,
    *,
    rig: Annotated[str, typer.Option(help="Shipped rig or a file: whose bus it is.")] = "virtual_lab",
    scenario: Annotated[str, typer.Option(help="The table, for whoever reads it later.")] = "paper",
    person: Annotated[str, typer.Option(help="Who attends, as they want to be called in the file.")] = "unnamed",
    seconds: Annotated[float, typer.Option(min=0.0, help="How long; 0 until Ctrl-C.")] = 0.0,
) -> None:
    """Listen to the bus of a rig that runs, and record all that its processes write. Exit code 1 if nothing came."""
    from robot.recording.watching_bus import record_bus  # brings Zenoh

    listened = record_bus(out, rig=rig, scenario=scenario, person=person, seconds=seconds, tell=_tell)
    typer.echo(f"{out}: {listened.n} messages, {listened.lost()} lost on the way, {listened.refused()} of another type")
    if not listened.n:
        raise typer.Exit(EXIT_FAILED)


@app.command()
def recover(session: Session, out: Out, *, json: Json = False) -> None:
    """Save what is whole in a torn or changed file, or in several that lie in one, into a new file."""
    saved = recover_session(session, out)
    if json:
        typer.echo(msgspec.json.encode(saved).decode())
        return
    typer.echo(f"{out}: {saved.n_messages} messages, up to {saved.end_ns / 1e9:.3f} s")
    if saved.n_files > 1:
        typer.echo(f"{saved.n_files} files lay one after another in it")
    if saved.n_unknown:
        typer.echo(f"{saved.n_unknown} messages are left out: nothing is known of their channel any more")
    for lost in saved.lost[:MOST_LOST]:
        typer.echo(f"lost: {lost.n_bytes} bytes from byte {lost.at} on: {lost.why}")
    if len(saved.lost) > MOST_LOST:
        typer.echo(f"and {len(saved.lost) - MOST_LOST} places more")


@app.command()
def cut(
    session: Session,
    out: Out,
    *,
    begin: Annotated[float, typer.Option("--from", min=0.0, help="Seconds of the session's time.")] = 0.0,
    end: Annotated[float | None, typer.Option("--to", help="Seconds; up to its end if left out.")] = None,
    epochs: Annotated[str | None, typer.Option(help="In place of times: FIRST-LAST, by their resets.")] = None,
    topic: Annotated[list[str] | None, typer.Option(help="Only these; may be given more than once.")] = None,
) -> None:
    """Write a part of a session into a new file."""
    if epochs is None:
        span = (round(begin * 1e9), (1 << 63) if end is None else round(end * 1e9))
    else:
        first, last = _epochs(epochs)
        with SessionFile(session) as opened:
            span = epochs_span(opened, first, last)
    n = cut_session(session, out, span=span, topics=topic)
    typer.echo(f"{out}: {n} messages")


@app.command()
def merge(
    sessions: Annotated[list[Path], typer.Argument(help="Sessions of one plant and one clock.")], out: Out
) -> None:
    """Write several sessions into one by their times; what lies in two of them is written once."""
    n = merge_sessions(sessions, out)
    typer.echo(f"{out}: {n} messages")


@app.command()
def view(
    session: Session,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Picture to write: png, svg or pdf.  [default: beside it]")
    ] = None,
    *,
    begin: Annotated[float, typer.Option("--from", min=0.0, help="Seconds of the session's time.")] = 0.0,
    end: Annotated[float | None, typer.Option("--to", help="Seconds; up to its end if left out.")] = None,
    video: Annotated[
        Path | None,
        typer.Option(help="Write a video there (.mp4) in place of a picture: its camera's frames, or drawn anew."),
    ] = None,
) -> None:
    """Draw joints and commands, tool, distances, percepts, verdicts and decisions over the session's time, or film it.

    A video is of a minute, where no end is given.
    """
    with SessionFile(session) as opened:
        if video is not None:
            from robot.recording.film import save_film  # brings OpenCV

            typer.echo(f"{video}: {save_film(opened, video, from_s=begin, to_s=end)}")
            return
        from robot.recording.view import save_view  # brings matplotlib

        typer.echo(save_view(opened, out or session.with_suffix(".png"), from_s=begin, to_s=end))


@app.command()
def replay(
    session: Session,
    *,
    to: Annotated[str, typer.Option(help="learning, twin, arm (a virtual one on a wire), or bus.")] = "learning",
    rig: Annotated[
        str | None, typer.Option(help="For twin and arm: a shipped rig or a file; the session's own if left out.")
    ] = None,
    bus: Annotated[str, typer.Option(help="For bus: where it is opened, on this machine.")] = "tcp/127.0.0.1:7457",
    rate: Annotated[float, typer.Option(min=0.01, max=100.0, help="For bus: so many times as fast.")] = 1.0,
    begin: Annotated[float, typer.Option("--from", min=0.0, help="For bus: seconds since its beginning.")] = 0.0,
    end: Annotated[float | None, typer.Option("--until", help="For bus: the same; its end if left out.")] = None,
    json: Json = False,
) -> None:
    """Let the learner, the twin or an arm live through a session again, or a bus tell it as if it were live.

    Exit code 1 if it does not come to the same; over a wire, if not all was carried out.
    """
    if to not in REPLAYERS:
        raise typer.BadParameter(f"expected {' or '.join(REPLAYERS)}, got {to!r}", param_hint="--to")
    if to not in ("twin", "arm") and rig is not None:
        raise typer.BadParameter("expected --to twin or arm beside it", param_hint="--rig")
    with redirected_stdout(STDERR):
        replayer = load(REPLAYERS[to])
        if to == "bus":
            until_s = float("inf") if end is None else end
            with StopRequest() as stop:
                done = replayer(session, endpoint=bus, rate=rate, from_s=begin, to_s=until_s, should_stop=stop)
        else:
            done = replayer(session) if rig is None else replayer(session, rig=rig)
    if json:
        typer.echo(msgspec.json.encode(done.told()).decode())
    else:
        for line in done.lines():
            typer.echo(line)
    if not done.is_same:
        raise typer.Exit(EXIT_FAILED)


def _tell(line: str) -> None:
    typer.echo(line, err=True)


def _epochs(text: str) -> tuple[int, int]:
    first, _, last = text.partition("-")
    if not first.isdigit() or not (last or first).isdigit():
        raise typer.BadParameter(f"expected FIRST-LAST or one number, got {text!r}", param_hint="--epochs")
    return int(first), int(last or first)
