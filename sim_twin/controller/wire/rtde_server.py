"""Port 30004: state out and registers in, for several clients that may each speak protocol 1 or 2.

Behaviour follows UR's RTDE guide. Where the guide is silent: a set-up with an unknown or taken field is answered with
recipe id 0 and claims nothing; a data package that does not fit its recipe is left unread and answered with a text
message; inputs are taken before `start` too, since ur_rtde's IO interface never sends it.
"""

import math
import struct
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Protocol

from sim_twin.controller.wire.errors import MalformedError
from sim_twin.controller.wire.peer import Peer
from sim_twin.controller.wire.rtde_codec import (
    FrameReader,
    Kind,
    Level,
    Recipe,
    frame,
    names_of,
    pack_text,
    unpack_frequency,
    unpack_text,
)
from sim_twin.controller.wire.rtde_fields import FieldType, Value, input_fields, output_fields
from sim_twin.controller.wire.version import ControllerVersion

__all__ = ["InputSink", "Outputs", "RtdeServer"]

Outputs = Mapping[str, Callable[[], Value]]
_STEP_HZ = 500.0
_OLD_HZ = 125.0
_N_NAMES_BYTES = 2048
_N_RECIPES = 255
_VERSION = struct.Struct(">4I")
_SOURCE = "RTDE"
_N_HEARD = 1000
"""Text messages of one client that are kept; a flood of them would push everything else out of the log."""
_ACCEPTED, _REFUSED = b"\x01", b"\x00"


class InputSink(Protocol):
    """Takes what clients write; a value stays until it is written again, whoever leaves."""

    def writer(self, name: str) -> Callable[[Value], None]:
        """Return what sets one input; the name and the type of what it takes are those of `input_fields`."""
        ...


class _Client:
    """One client: its protocol, its recipes and its pace."""

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        self.reader = FrameReader()
        self.protocol = 1
        self.output: Recipe | None = None
        self.getters: list[tuple[Callable[[], Value], bool]] = []
        self.inputs: dict[int, tuple[Recipe, list[Callable[[Value], None]]]] = {}
        self.rate_hz = 0.0
        self.is_started = False
        self.n_heard = 0

    def package(self) -> bytes:
        """Return the next data package; only for a client with an output recipe."""
        assert self.output is not None
        numbers: list = []
        for getter, is_vector in self.getters:
            if is_vector:
                numbers.extend(getter())  # pyright: ignore[reportArgumentType] -- the recipe says that it is a vector
            else:
                numbers.append(getter())
        return self.output.pack(numbers)


class RtdeServer:
    """Answers RTDE clients; a `Service` of the reactor.

    `tick` sends the packages that are due. Nothing that a client sends raises: a stream that cannot be followed any
    more costs that client its connection.
    """

    def __init__(
        self,
        *,
        outputs: Outputs,
        inputs: InputSink,
        version: ControllerVersion,
        hear: Callable[[str], None] | None = None,
    ) -> None:
        """Store; hear takes what clients say in text messages."""
        self._outputs, self._hear = outputs, hear
        self._sink = inputs
        self._version = version
        self._slices_a_cycle = round(_STEP_HZ / _OLD_HZ) if version.is_cb3 else 1
        self._fastest_hz = _STEP_HZ / self._slices_a_cycle
        known = output_fields(version)
        self._output_kinds = {name: kind for name, kind in known.items() if name in outputs}
        self._input_kinds = input_fields(version)
        self._clients: dict[Peer, _Client] = {}
        self._owner_by_input: dict[str, Peer] = {}
        self._reserved: frozenset[str] = frozenset()
        self._answers: dict[int, Callable[[_Client, bytes], None]] = {
            Kind.PROTOCOL: self._choose_protocol,
            Kind.CONTROLLER: self._tell_version,
            Kind.OUTPUTS: self._set_outputs,
            Kind.INPUTS: self._set_inputs,
            Kind.START: self._start,
            Kind.PAUSE: self._pause,
            Kind.DATA: self._write,
            Kind.TEXT: self._take_text,
        }

    @property
    def n_clients(self) -> int:
        """Clients that are connected."""
        return len(self._clients)

    @property
    def n_started(self) -> int:
        """Clients that are being sent data."""
        return sum(client.is_started for client in self._clients.values())

    def opened(self, peer: Peer) -> None:
        """Expect a new client's first message."""
        self._clients[peer] = _Client(peer)

    def received(self, peer: Peer, chunk: bytes) -> None:
        """Answer the messages that are complete."""
        client = self._clients[peer]
        try:
            for kind, payload in client.reader.feed(chunk):
                self._answer(client, kind, payload)
                if not peer.is_open:
                    return
        except MalformedError:
            peer.close()

    def closed(self, peer: Peer) -> None:
        """Release every input that the client had claimed; their values stay."""
        del self._clients[peer]
        self._owner_by_input = {name: owner for name, owner in self._owner_by_input.items() if owner is not peer}

    def tick(self, control_step: int) -> None:
        """Send each started client its package if one came due with this 2 ms step."""
        n_cycles, slices_left = divmod(control_step, self._slices_a_cycle)
        if slices_left:
            return
        for client in tuple(self._clients.values()):
            if client.is_started and self._is_due(n_cycles, client.rate_hz):
                client.peer.stream(client.package())

    def say(self, message: str, *, level: Level = Level.INFO, source: str = _SOURCE) -> None:
        """Send a text message to every client that is sent data: to others, whatever comes next is their answer."""
        for client in tuple(self._clients.values()):
            if client.is_started:
                self._say_to(client, message, level, source)

    def reserve(self, names: Collection[str]) -> None:
        """Fault: let these inputs be in use by a field bus from now on; no names frees them again."""
        self._reserved = frozenset(names)

    def _answer(self, client: _Client, kind: int, payload: bytes) -> None:
        answer = self._answers.get(kind)
        if answer is None:
            self._say_to(client, f"expected one of the messages VvMUOISP, came type {kind}", Level.ERROR)
        else:
            answer(client, payload)

    def _say_to(self, client: _Client, message: str, level: Level, source: str = _SOURCE) -> None:
        client.peer.reply(pack_text(message, source=source, level=level, protocol=client.protocol))

    def _take_text(self, client: _Client, payload: bytes) -> None:
        if self._hear is None or client.n_heard >= _N_HEARD:
            return
        client.n_heard += 1
        message, source, level = unpack_text(payload, protocol=client.protocol)
        self._hear(f"RTDE client {source or 'without a name'}, level {level}: {message}")

    def _choose_protocol(self, client: _Client, payload: bytes) -> None:
        if len(payload) != 2:
            raise MalformedError(f"expected a protocol version of 2 bytes, came {len(payload)}")
        asked = int.from_bytes(payload, "big")
        if asked in (1, 2):
            client.protocol = asked
        client.peer.reply(frame(Kind.PROTOCOL, _ACCEPTED if asked in (1, 2) else _REFUSED))

    def _tell_version(self, client: _Client, _payload: bytes) -> None:
        v = self._version
        client.peer.reply(frame(Kind.CONTROLLER, _VERSION.pack(v.major, v.minor, v.bugfix, v.build)))

    def _set_outputs(self, client: _Client, payload: bytes) -> None:
        rate_hz = _OLD_HZ
        if client.protocol > 1:
            rate_hz, payload = unpack_frequency(payload)
        names = _names(payload)
        kinds = [self._output_kinds.get(name) for name in names]
        client.is_started = False
        found = [kind for kind in kinds if kind is not None]
        if not names or len(found) < len(kinds):
            client.output = None
        else:
            client.output = Recipe(names, found, recipe_id=1 if client.protocol > 1 else None)
            client.getters = [(self._outputs[n], k.n_items > 1) for n, k in zip(names, found, strict=True)]
            client.rate_hz = self._pace_hz(rate_hz)
        self._confirm(client, Kind.OUTPUTS, int(client.output is not None), [kind or "NOT_FOUND" for kind in kinds])

    def _set_inputs(self, client: _Client, payload: bytes) -> None:
        names = _names(payload)
        kinds = [self._input_kinds.get(name) for name in names]
        found = [kind for kind in kinds if kind is not None]
        taken = {n for n in names if n in self._reserved or self._owner_by_input.get(n, client.peer) is not client.peer}
        recipe_id = len(client.inputs) + 1 if client.protocol > 1 else 1
        if not names or len(found) < len(kinds) or taken or recipe_id > _N_RECIPES:
            recipe_id = 0
        else:
            recipe = Recipe(names, found, recipe_id=recipe_id if client.protocol > 1 else None)
            client.inputs[recipe_id] = recipe, [self._sink.writer(name) for name in names]
            self._owner_by_input |= dict.fromkeys(names, client.peer)
        words = ["IN_USE" if n in taken else (k or "NOT_FOUND") for n, k in zip(names, kinds, strict=True)]
        self._confirm(client, Kind.INPUTS, recipe_id, words)

    def _confirm(self, client: _Client, kind: Kind, recipe_id: int, words: Sequence[FieldType | str]) -> None:
        head = bytes([recipe_id]) if client.protocol > 1 else b""
        client.peer.reply(frame(kind, head + ",".join(words).encode()))
        if not words:
            # After the reply: ur_rtde takes whatever comes next for it.
            self._say_to(client, f"expected 1 to {_N_NAMES_BYTES} bytes of field names, set up fewer", Level.ERROR)

    def _pace_hz(self, rate_hz: float) -> float:
        """Return the rate that a client gets; no sensible rate means the fastest."""
        is_sensible = math.isfinite(rate_hz) and rate_hz > 0.0
        return min(rate_hz, self._fastest_hz) if is_sensible else self._fastest_hz

    def _is_due(self, n_cycles: int, rate_hz: float) -> bool:
        """Return whether a package came due with this cycle: none is early, none a whole cycle late."""
        return n_cycles * rate_hz // self._fastest_hz > (n_cycles - 1) * rate_hz // self._fastest_hz

    def _start(self, client: _Client, _payload: bytes) -> None:
        client.is_started = client.output is not None
        client.peer.reply(frame(Kind.START, _ACCEPTED if client.is_started else _REFUSED))
        if not client.is_started:
            self._say_to(client, "expected an output recipe before start; set up at least one output", Level.ERROR)

    def _pause(self, client: _Client, _payload: bytes) -> None:
        client.is_started = False
        client.peer.reply(frame(Kind.PAUSE, _ACCEPTED))

    def _write(self, client: _Client, payload: bytes) -> None:
        recipe_id, body = (payload[0] if payload else 0, payload[1:]) if client.protocol > 1 else (1, payload)
        if recipe_id not in client.inputs:
            self._say_to(client, f"expected an input recipe that was set up, came id {recipe_id}", Level.ERROR)
            return
        recipe, writers = client.inputs[recipe_id]
        try:
            values = recipe.unpack(body)
        except MalformedError as problem:
            self._say_to(client, str(problem), Level.ERROR)
            return
        for write, value in zip(writers, values, strict=True):
            write(value)


def _names(payload: bytes) -> list[str]:
    return names_of(payload) if len(payload) <= _N_NAMES_BYTES else []
