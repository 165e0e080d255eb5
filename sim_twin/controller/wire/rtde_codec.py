"""RTDE messages as bytes: frames, set-up replies and one compiled layout per recipe. Pure.

A frame is a big-endian 16-bit size that counts itself, an 8-bit kind and the rest.
"""

import struct
from collections.abc import Sequence
from enum import IntEnum

from sim_twin.controller.wire.errors import MalformedError
from sim_twin.controller.wire.rtde_fields import FieldType, Value

__all__ = ["FrameReader", "Kind", "Level", "Recipe", "frame", "names_of", "pack_text", "unpack_frequency"]

_HEADER = struct.Struct(">HB")
_FREQUENCY = struct.Struct(">d")
_N_TEXT = 255


class Kind(IntEnum):
    """What a frame carries: the ASCII letter of the message."""

    PROTOCOL = ord("V")
    CONTROLLER = ord("v")
    TEXT = ord("M")
    DATA = ord("U")
    OUTPUTS = ord("O")
    INPUTS = ord("I")
    START = ord("S")
    PAUSE = ord("P")


class Level(IntEnum):
    """How grave a text message is."""

    EXCEPTION = 0
    ERROR = 1
    WARNING = 2
    INFO = 3


class FrameReader:
    """Cuts a byte stream into frames, wherever TCP has cut it before."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, chunk: bytes) -> list[tuple[int, bytes]]:
        """Return the frames that are complete now as (kind, payload).

        Raises:
            MalformedError: A size is smaller than the header, so that no later byte can be trusted.
        """
        stock = self._bytes
        stock += chunk
        frames: list[tuple[int, bytes]] = []
        at = 0
        while len(stock) - at >= _HEADER.size:
            size, kind = _HEADER.unpack_from(stock, at)
            if size < _HEADER.size:
                raise MalformedError(f"expected an RTDE frame of at least 3 bytes, came a size of {size}; reconnect")
            if len(stock) - at < size:
                break
            frames.append((kind, bytes(stock[at + _HEADER.size : at + size])))
            at += size
        del stock[:at]
        return frames


class Recipe:
    """The layout of one data package, compiled once.

    Attributes:
        names: The fields in the order in which they travel.
        kinds: Their types.
        n_bytes: The whole frame's size.
    """

    def __init__(self, names: Sequence[str], kinds: Sequence[FieldType], *, recipe_id: int | None) -> None:
        """Compile; a `recipe_id` of None is protocol 1, whose data packages carry no id."""
        self.names = tuple(names)
        self.kinds = tuple(kinds)
        body = "".join(kind.code for kind in kinds)
        self._head: tuple[int, ...] = () if recipe_id is None else (recipe_id,)
        self._body = struct.Struct(">" + body)
        self._frame = struct.Struct(">HB" + "B" * len(self._head) + body)
        self.n_bytes = self._frame.size
        self._parts: list[tuple[int, int]] = []
        """First number and how many, of each field."""
        at = 0
        for kind in self.kinds:
            self._parts.append((at, kind.n_items))
            at += kind.n_items

    def pack(self, numbers: Sequence[float]) -> bytes:
        """Return the frame of a data package; vectors come flattened, in the recipe's order."""
        return self._frame.pack(self.n_bytes, Kind.DATA, *self._head, *numbers)

    def unpack(self, body: bytes) -> Sequence[Value]:
        """Return a data package's values without its recipe id, in the recipe's order; vectors are tuples.

        Raises:
            MalformedError: The size does not fit the recipe.
        """
        if len(body) != self._body.size:
            raise MalformedError(
                f"expected {self._body.size} bytes for {len(self.names)} fields, came {len(body)}; "
                "check the recipe id and the order of the fields"
            )
        numbers = self._body.unpack(body)
        if len(numbers) == len(self._parts):
            return numbers
        return [numbers[at] if n == 1 else numbers[at : at + n] for at, n in self._parts]


def frame(kind: Kind, payload: bytes) -> bytes:
    """Return a message with its header."""
    return _HEADER.pack(_HEADER.size + len(payload), kind) + payload


def pack_text(message: str, *, source: str, level: Level, protocol: int) -> bytes:
    """Return a text message for a client of protocol 1 or 2; long texts are cut."""
    said, by = message.encode()[:_N_TEXT], source.encode()[:_N_TEXT]
    if protocol == 1:
        return frame(Kind.TEXT, bytes([level]) + said)
    return frame(Kind.TEXT, bytes([len(said)]) + said + bytes([len(by)]) + by + bytes([level]))


def unpack_text(payload: bytes, *, protocol: int) -> tuple[str, str, int]:
    """Return message, source and level of a client's text message; protocol 1 has no source.

    Raises:
        MalformedError: It is shorter than it says.
    """
    if protocol == 1:
        return (payload[1:].decode("utf-8", "replace"), "", payload[0]) if payload else ("", "", 0)
    parts, at = [], 0
    for _ in range(2):
        n_bytes = payload[at] if at < len(payload) else len(payload)
        parts.append(payload[at + 1 : at + 1 + n_bytes].decode("utf-8", "replace"))
        at += 1 + n_bytes
    if at >= len(payload):
        raise MalformedError(f"expected a text, a source and a level, came {len(payload)} bytes")
    return parts[0], parts[1], payload[at]


def names_of(payload: bytes) -> list[str]:
    """Return the field names of a set-up; a trailing comma and blanks are allowed."""
    parts = payload.decode("ascii", "replace").split(",")
    if parts and not parts[-1].strip("\0 \n"):
        parts.pop()
    return [part.strip("\0 \n") for part in parts]


def unpack_frequency(payload: bytes) -> tuple[float, bytes]:
    """Return the frequency of a protocol 2 output set-up and the rest.

    Raises:
        MalformedError: There is no room for a frequency.
    """
    if len(payload) < _FREQUENCY.size:
        raise MalformedError(f"expected a frequency of 8 bytes and field names, came {len(payload)} bytes")
    return _FREQUENCY.unpack_from(payload)[0], payload[_FREQUENCY.size :]
