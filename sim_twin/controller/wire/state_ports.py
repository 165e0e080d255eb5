"""Ports 30001 to 30003 and their read-only twins 30011 to 30013: state out, scripts in."""

from collections.abc import Callable
from enum import Enum
from typing import Protocol

from sim_twin.controller.wire.peer import Budget, Peer
from sim_twin.controller.wire.primary import pack_state
from sim_twin.controller.wire.primary_messages import pack_version
from sim_twin.controller.wire.primary_state import PrimaryState
from sim_twin.controller.wire.realtime import RealtimeState, pack_realtime, realtime_size
from sim_twin.controller.wire.script_framer import N_LINE_BYTES, N_PROGRAM_CHARS, N_PROGRAM_LINES, ScriptFramer
from sim_twin.controller.wire.version import ControllerVersion

__all__ = ["SCRIPT_BUDGET", "PortKind", "ScriptSink", "ScriptSource", "StatePort", "StatePorts", "StateSource"]

# A script of ur_rtde has 42 kB; it arrives within eleven polls.
SCRIPT_BUDGET = Budget(bytes_a_poll=4096)
_TOO_LONG = (
    f"expected a program of at most {N_PROGRAM_CHARS} characters and {N_PROGRAM_LINES} lines, "
    f"each of at most {N_LINE_BYTES} bytes"
)
_SLOW_STEPS = 50
_OLD_STEPS = 4


class PortKind(Enum):
    """What a port sends."""

    PRIMARY = "primary"
    SECONDARY = "secondary"
    REALTIME = "realtime"


class ScriptSource:
    """Where a script came from: the kind of port and the peer's address."""

    def __init__(self, kind: PortKind, peer: Peer) -> None:
        self.kind = kind
        self.peer = peer

    @property
    def address(self) -> tuple[str, int]:
        """The peer's IP address and port."""
        return self.peer.address


class ScriptSink(Protocol):
    """Runs what is uploaded."""

    def submit_script(self, text: str, source: ScriptSource) -> None:
        """Take one complete program; it is compiled and started elsewhere, not within this call."""
        ...

    def refuse_script(self, why: str, source: ScriptSource) -> None:
        """Say why an upload is not read to its end; its connection is closed."""
        ...


class StateSource(Protocol):
    """The state that is sent; asked only when somebody listens."""

    def primary_state(self) -> PrimaryState:
        """Return the state for 30001 and 30002."""
        ...

    def realtime_state(self) -> RealtimeState:
        """Return the state for 30003."""
        ...


class StatePort:
    """One port; a `Service` of the reactor. Without a sink what is uploaded is ignored: a read-only port."""

    def __init__(self, kind: PortKind, *, greet: Callable[[], bytes], scripts: ScriptSink | None) -> None:
        self.kind = kind
        self._greet = greet
        self._scripts = scripts
        self._framers: dict[Peer, ScriptFramer] = {}

    @property
    def n_peers(self) -> int:
        """Clients that are connected."""
        return len(self._framers)

    def opened(self, peer: Peer) -> None:
        """Greet: the primary and secondary ports begin with the version."""
        self._framers[peer] = ScriptFramer()
        greeting = self._greet()
        if greeting:
            peer.reply(greeting)

    def received(self, peer: Peer, chunk: bytes) -> None:
        """Hand over the programs that are complete."""
        if self._scripts is None:
            return
        framer = self._framers[peer]
        for text in framer.feed(chunk):
            self._scripts.submit_script(text, ScriptSource(self.kind, peer))
        if framer.is_overlong:
            self._scripts.refuse_script(_TOO_LONG, ScriptSource(self.kind, peer))
            peer.close()

    def closed(self, peer: Peer) -> None:
        """Forget the peer; half a program is never run."""
        del self._framers[peer]

    def stream(self, package: bytes) -> None:
        """Send a package to every client that keeps up."""
        for peer in tuple(self._framers):
            peer.stream(package)

    def takers(self, n_bytes: int) -> list[Peer]:
        """Return the clients that keep up with packages of this size."""
        return [peer for peer in self._framers if peer.has_room(n_bytes)]


class StatePorts:
    """The six ports as one.

    Attributes:
        primary: Service for 30001.
        secondary: Service for 30002.
        realtime: Service for 30003.
        primary_read_only: Service for 30011.
        secondary_read_only: Service for 30012.
        realtime_read_only: Service for 30013.
    """

    def __init__(
        self, *, states: StateSource, scripts: ScriptSink, version: ControllerVersion, stamp_us: Callable[[], int]
    ) -> None:
        """Store; `stamp_us` is the controller's own time."""

        def greet() -> bytes:
            return pack_version(version, stamp_us=stamp_us())

        def silent() -> bytes:
            return b""

        self.primary = StatePort(PortKind.PRIMARY, greet=greet, scripts=scripts)
        self.secondary = StatePort(PortKind.SECONDARY, greet=greet, scripts=scripts)
        self.realtime = StatePort(PortKind.REALTIME, greet=silent, scripts=scripts)
        self.primary_read_only = StatePort(PortKind.PRIMARY, greet=greet, scripts=None)
        self.secondary_read_only = StatePort(PortKind.SECONDARY, greet=greet, scripts=None)
        self.realtime_read_only = StatePort(PortKind.REALTIME, greet=silent, scripts=None)
        self._states = states
        self._version = version
        self._slow = (self.primary, self.secondary, self.primary_read_only, self.secondary_read_only)
        self._fast = (self.realtime, self.realtime_read_only)
        self._fast_steps = _OLD_STEPS if version.is_cb3 else 1
        self._realtime_bytes = realtime_size(version)

    @property
    def by_number(self) -> dict[int, StatePort]:
        """The services by UR's port numbers."""
        return {
            30001: self.primary,
            30002: self.secondary,
            30003: self.realtime,
            30011: self.primary_read_only,
            30012: self.secondary_read_only,
            30013: self.realtime_read_only,
        }

    def tick(self, control_step: int) -> None:
        """Send what is due in this 2 ms step: 10 Hz on the first two, 500 Hz (CB3: 125 Hz) on the third.

        A realtime package is made only where somebody takes it: ur_rtde's script client holds the third port open and
        never reads, and packing costs a tenth of the controller's tick.
        """
        if control_step % self._fast_steps == 0:
            takers = [peer for port in self._fast for peer in port.takers(self._realtime_bytes)]
            if takers:
                package = pack_realtime(self._states.realtime_state(), self._version)
                for peer in takers:
                    peer.stream(package)
        if control_step % _SLOW_STEPS == 0 and any(port.n_peers for port in self._slow):
            package = pack_state(self._states.primary_state(), self._version)
            for port in self._slow:
                port.stream(package)

    def tell(self, message: bytes) -> None:
        """Send a robot message to those clients of the primary ports, who alone receive them, that keep up."""
        self.primary.stream(message)
        self.primary_read_only.stream(message)
