"""Port 29999: one command a line, one line back, in UR's exact words.

The words are those of UR's dashboard pages and of what public clients match on. Where those pages know one reply to a
command, it is given whether or not the arm follows: `power on` to an arm that runs is answered "Powering on" and
changes nothing (Universal_Robots_Client_Library, pull request 397). In local control the commands that act are refused,
in the words that public projects quote from robots, and a connection that was made in local control stays refused:
UR asks for a reconnect, so does this.
"""

from collections import deque
from collections.abc import Callable
from typing import TypeAlias

import msgspec

from sim_twin.controller.wire.dashboard_target import DashboardStatus, DashboardTarget, Outcome
from sim_twin.controller.wire.lines import LineReader
from sim_twin.controller.wire.peer import Peer
from sim_twin.controller.wire.version import ControllerVersion

__all__ = ["GREETING", "NOT_REMOTE", "TOO_EARLY", "DashboardServer"]

GREETING = "Connected: Universal Robots Dashboard Server"
NOT_REMOTE = (
    "Command is not allowed due to safety reasons, "
    "please switch robot to Remote Control mode and reconnect to port 29999"
)
TOO_EARLY = (
    "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking"
)
_N_LINE_BYTES = 4096
_N_WORDS = 4
_N_LINES = 100
"""Lines that wait behind a reply which is not known yet; a client that sends more is cut off."""
_ALWAYS = ((5, 0), (3, 0))
_Later: TypeAlias = Callable[[], str | None]
"""Returns a reply once there is one."""


class _Command(msgspec.Struct, frozen=True):
    """One command.

    Attributes:
        answer: Returns the reply to the text after the command's words, or what returns it later.
        is_acting: Whether it needs remote control.
        since: First version of an e-Series and of a CB3 that knows it.
    """

    answer: Callable[[str], str | _Later]
    is_acting: bool = False
    since: tuple[tuple[int, ...] | None, tuple[int, ...] | None] = _ALWAYS


class _Client:
    """One client: its unfinished line, what it waits for, and whether it connected in remote control."""

    def __init__(self, is_remote: bool) -> None:
        self.lines = LineReader(_N_LINE_BYTES)
        self.is_remote = is_remote
        self.asked: deque[str] = deque()
        self.later: _Later | None = None


class DashboardServer:
    """Answers dashboard clients; a `Service` of the reactor."""

    def __init__(self, *, target: DashboardTarget, version: ControllerVersion) -> None:
        self._target = target
        self._version = version
        self._clients: dict[Peer, _Client] = {}
        commands = _queries(target, version) | _power(target) | _programs(target) | _panel(target)
        self._commands = {words: command for words, command in commands.items() if version.has(*command.since)}

    def opened(self, peer: Peer) -> None:
        """Greet: ur_rtde waits for this line before it asks anything."""
        self._clients[peer] = _Client(self._target.status().is_remote)
        peer.reply(f"{GREETING}\n".encode())

    def received(self, peer: Peer, chunk: bytes) -> None:
        """Answer the lines that are complete."""
        client = self._clients[peer]
        client.asked.extend(line.decode("utf-8", "replace").strip() for line in client.lines.feed(chunk))
        self._go_on(peer, client)
        if peer.is_open and (client.lines.is_overlong or len(client.asked) > _N_LINES):
            peer.close()

    def tick(self) -> None:
        """Give the replies that are known by now."""
        for peer, client in [(p, c) for p, c in self._clients.items() if c.later is not None]:
            self._go_on(peer, client)

    def closed(self, peer: Peer) -> None:
        """Forget the client."""
        del self._clients[peer]

    def _go_on(self, peer: Peer, client: _Client) -> None:
        """Answer what was asked, in order, as far as the replies are known."""
        while peer.is_open:
            later = client.later
            if later is not None:
                reply = later()
                if reply is None:
                    return
                client.later = None
                peer.reply(f"{reply}\n".encode())
            elif client.asked:
                self._answer(peer, client, client.asked.popleft())
            else:
                return

    def _answer(self, peer: Peer, client: _Client, line: str) -> None:
        if line.lower() == "quit":
            client.asked.clear()
            peer.reply(b"Disconnected\n")
            peer.close_when_sent()
            return
        reply = self._reply(client, line)
        if isinstance(reply, str):
            peer.reply(f"{reply}\n".encode())
        else:
            client.later = reply

    def _reply(self, client: _Client, line: str) -> str | _Later:
        words, rest = self._split(line)
        command = self._commands.get(words)
        if command is None:
            return f"could not understand: {line}"
        if command.is_acting and self._version.has((5, 0), None) and not self._is_remote(client):
            return NOT_REMOTE
        return command.answer(rest)

    def _is_remote(self, client: _Client) -> bool:
        client.is_remote = client.is_remote and self._target.status().is_remote
        return client.is_remote

    def _split(self, line: str) -> tuple[str, str]:
        """Return the longest command that the line begins with, and the rest: "load installation x" is no "load"."""
        for n in range(_N_WORDS, 0, -1):
            words = " ".join(line.split(" ", n)[:n]).lower()
            if words in self._commands:
                return words, line[len(words) :].strip()
        return "", ""


def _said(outcome: Outcome, done: str, failed: str) -> str:
    return done if outcome is Outcome.DONE else failed


def _queries(target: DashboardTarget, version: ControllerVersion) -> dict[str, _Command]:
    def ask(tell: Callable[[DashboardStatus], str], since: tuple = _ALWAYS) -> _Command:
        return _Command(lambda _rest: tell(target.status()), since=since)

    def program(status: DashboardStatus) -> str:
        return status.program.rsplit("/", 1)[-1] if status.program else "<unnamed>"

    since_names = ((5, 6), (3, 12))
    return {
        "robotmode": ask(lambda s: f"Robotmode: {s.robot_mode}"),
        "safetymode": ask(lambda s: f"Safetymode: {s.safety_mode}"),
        "safetystatus": ask(lambda s: f"Safetystatus: {s.safety_status}", ((5, 4), (3, 11))),
        "running": ask(lambda s: f"Program running: {_truth(s.is_running)}"),
        "programstate": ask(lambda s: f"{s.program_state} {program(s)}"),
        "get loaded program": ask(lambda s: f"Loaded program: {s.program}" if s.program else "No program loaded"),
        "isprogramsaved": ask(lambda s: f"{_truth(s.is_program_saved)} {program(s)}"),
        "is in remote control": ask(lambda s: _truth(s.is_remote), ((5, 6), None)),
        "get operational mode": ask(lambda s: s.operational_mode, ((5, 6), None)),
        "get robot model": ask(lambda s: s.robot_model, since_names),
        "get serial number": ask(lambda s: s.serial_number, since_names),
        "polyscopeversion": ask(lambda s: f"URSoftware {version} ({s.build_date})"),
        "version": ask(lambda _s: str(version), ((5, 0), None)),
    }


def _truth(is_true: bool) -> str:
    return "true" if is_true else "false"


def _power(target: DashboardTarget) -> dict[str, _Command]:
    def act(do: Callable[[], Outcome], said: str) -> _Command:
        def answer(_rest: str) -> str:
            return TOO_EARLY if do() is Outcome.TOO_EARLY else said

        return _Command(answer, is_acting=True)

    return {
        "power on": act(target.power_on, "Powering on"),
        "power off": act(target.power_off, "Powering off"),
        "brake release": act(target.brake_release, "Brake releasing"),
        "unlock protective stop": act(target.unlock_protective_stop, "Protective stop releasing"),
        "close safety popup": act(target.close_safety_popup, "closing safety popup"),
        "restart safety": act(target.restart_safety, "Restarting safety"),
        "shutdown": act(target.shutdown, "Shutting down"),
    }


def _programs(target: DashboardTarget) -> dict[str, _Command]:
    def act(words: str, do: Callable[[], Outcome], done: str) -> _Command:
        return _Command(lambda _rest: _said(do(), done, f"Failed to execute: {words}"), is_acting=True)

    def play(_rest: str) -> _Later:
        awaited = target.play()

        def reply() -> str | None:
            outcome = awaited()
            return None if outcome is None else _said(outcome, "Starting program", "Failed to execute: play")

        return reply

    def load(what: str, do: Callable[[str], Outcome], failed: str) -> _Command:
        def answer(path: str) -> str:
            outcome = do(path)
            if outcome is Outcome.NOT_FOUND:
                return f"File not found: {path}"
            return _said(outcome, f"Loading {what}: {path}", f"{failed}: {path}")

        return _Command(answer, is_acting=True)

    return {
        "play": _Command(play, is_acting=True),
        "stop": act("stop", target.stop, "Stopped"),
        "pause": act("pause", target.pause, "Pausing program"),
        "load": load("program", target.load, "Error while loading program"),
        "load installation": load("installation", target.load_installation, "Failed to load installation"),
    }


def _panel(target: DashboardTarget) -> dict[str, _Command]:
    def say(do: Callable[[str], Outcome], said: str) -> _Command:
        def answer(rest: str) -> str:
            do(rest)
            return said

        return _Command(answer)

    def set_mode(rest: str) -> str:
        mode = rest.upper()
        is_known = mode in ("MANUAL", "AUTOMATIC")
        outcome = target.set_operational_mode(mode) if is_known else Outcome.FAILED
        return _said(outcome, f"Operational mode {mode} is set", f"Failed setting operational mode to {rest}")

    def clear_mode(_rest: str) -> str:
        target.clear_operational_mode()
        mode = target.status().operational_mode
        return f"No longer controlling the operational mode. Current operational mode: '{mode}'."

    def set_role(rest: str) -> str:
        return _said(target.set_user_role(rest), f"Setting user role: {rest}", f"Failed setting user role: {rest}")

    return {
        "popup": say(target.popup, "showing popup"),
        "close popup": say(lambda _rest: target.close_popup(), "closing popup"),
        "addtolog": say(target.add_to_log, "Added log message"),
        "set operational mode": _Command(set_mode, is_acting=True),
        "clear operational mode": _Command(clear_mode, is_acting=True),
        "setuserrole": _Command(set_role, since=(None, (3, 1))),
    }
