"""Port 63352: the text protocol of Robotiq's URCap for a 2F gripper.

`GET POS` is answered `POS 123` and a newline. `SET POS 255 GTO 1` is answered `ack` without a newline: URScript reads
exactly three bytes there, and ur_rtde compares the whole answer. An unknown name or value is answered `?`. The port
does not look at the robot's safety state: on the arm too the socket works during a protective stop.
"""

from typing import Protocol

import msgspec

from sim_twin.controller.wire.lines import LineReader
from sim_twin.controller.wire.peer import Peer

__all__ = ["GripperMeasurement", "GripperRequest", "GripperServer", "GripperTarget"]

_N_LINE_BYTES = 512
_ACK = b"ack"
_UNKNOWN = b"?\n"


class GripperRequest(msgspec.Struct, frozen=True, kw_only=True):
    """What the clients asked for last, in the gripper's registers.

    Attributes:
        act: 1 activates: the fingers stroke fully open and shut once. 0 resets.
        gto: 1 goes to the position; 0 stands.
        atr: 1 releases slowly, as in an emergency.
        ard: Direction of that release: 0 closes, 1 opens.
        pos: Position, 0 open to 255 shut.
        spe: Speed, 0 slowest to 255 fastest.
        force: Force, 0 to 255.
    """

    act: int = 0
    gto: int = 0
    atr: int = 0
    ard: int = 0
    pos: int = 0
    spe: int = 0
    force: int = 0


class GripperMeasurement(msgspec.Struct, frozen=True, kw_only=True):
    """What the gripper reports.

    Attributes:
        pos: Position, 0 open to 255 shut.
        pre: The requested position, as the gripper echoes it once it has taken it.
        sta: 0 reset, 1 activating, 3 active.
        obj: 0 moving, 1 stopped by an object while opening, 2 while closing, 3 there or nothing found.
        flt: 0 none, 5 to 15 the fault.
        is_powered: False while the tool has no power: every value is then `?`.
    """

    pos: int
    pre: int
    sta: int
    obj: int
    flt: int = 0
    is_powered: bool = True


class GripperTarget(Protocol):
    """The gripper behind the port."""

    @property
    def requested(self) -> GripperRequest:
        """Its registers as they are; it loses them with its power."""
        ...

    def request(self, request: GripperRequest) -> None:
        """Take new registers; called once for each SET, with all of its values together."""
        ...

    def measure(self) -> GripperMeasurement:
        """Return what the gripper reports now."""
        ...


_SETTABLE = {
    "ACT": ("act", 1),
    "GTO": ("gto", 1),
    "ATR": ("atr", 1),
    "ARD": ("ard", 1),
    "ADR": ("ard", 1),
    "POS": ("pos", 255),
    "SPE": ("spe", 255),
    "FOR": ("force", 255),
}
_MEASURED = {"POS": "pos", "PRE": "pre", "STA": "sta", "OBJ": "obj", "FLT": "flt"}


class GripperServer:
    """Answers gripper clients, who share one gripper; a `Service` of the reactor."""

    def __init__(self, *, target: GripperTarget) -> None:
        self._target = target
        self._lines: dict[Peer, LineReader] = {}

    def opened(self, peer: Peer) -> None:
        """Expect a client's first line; there is no greeting."""
        self._lines[peer] = LineReader(_N_LINE_BYTES)

    def received(self, peer: Peer, chunk: bytes) -> None:
        """Answer the lines that are complete."""
        reader = self._lines[peer]
        for line in reader.feed(chunk):
            words = line.decode("ascii", "replace").split()
            if words:
                peer.reply(self._answer(words))
        if reader.is_overlong:
            peer.close()

    def closed(self, peer: Peer) -> None:
        """Forget the client; the gripper goes on."""
        del self._lines[peer]

    def _answer(self, words: list[str]) -> bytes:
        match words:
            case ["GET", name]:
                return self._get(name)
            case ["SET", *pairs] if pairs and len(pairs) % 2 == 0:
                return self._set(pairs)
            case _:
                return _UNKNOWN

    def _get(self, name: str) -> bytes:
        measured = self._target.measure()
        if name in _MEASURED:
            value = getattr(measured, _MEASURED[name])
        elif name in _SETTABLE:
            value = getattr(self._target.requested, _SETTABLE[name][0])
        else:
            return _UNKNOWN
        return f"{name} {value if measured.is_powered else '?'}\n".encode()

    def _set(self, pairs: list[str]) -> bytes:
        changes: dict[str, int] = {}
        for name, text in zip(pairs[::2], pairs[1::2], strict=True):
            field, greatest = _SETTABLE.get(name, ("", -1))
            # A number of a thousand digits would make int raise.
            if not (text.isdigit() and len(text) <= 3 and int(text) <= greatest):
                return _UNKNOWN
            changes[field] = int(text)
        self._target.request(msgspec.structs.replace(self._target.requested, **changes))
        return _ACK
