"""The socket functions. They wait in slices: a timeout of two seconds is as many slices as that, whatever the clock.

A connection is known by its name. Where a read does not get what it waits for, it returns what a robot returns: an
empty string, or a count of zero before -1 or nan. A timeout of zero or less waits for ever.
"""

import math
import re
import struct
from collections.abc import Callable, Generator
from typing import TypeAlias, TypeVar

from sim_twin.controller.script.arithmetic import int32
from sim_twin.controller.script.builtins.arguments import flag, integer, text
from sim_twin.controller.script.builtins.arguments import number as as_number
from sim_twin.controller.script.builtins.connection import Connection
from sim_twin.controller.script.builtins.waiting import slices_in
from sim_twin.controller.script.code import Builtins
from sim_twin.controller.script.threads import Wait
from sim_twin.controller.script.values import Value, text_of

__all__ = ["N_CONNECTIONS", "Sockets"]

N_CONNECTIONS = 32
"""Of one program; one more is not opened."""

T = TypeVar("T")
_Waiting: TypeAlias = Generator[Wait, None, T]

_FIRST = "socket_0"
_OPEN_TIMEOUT_S = 2.0
_N_NUMBERS_MAX = 30  # in one read
_N_TEXT_MAX = 1023  # bytes of a string; a robot counts its end in
_PARENTHESES = re.compile(rb"\([^()]*\)")
_WHOLE = re.compile(r"-?[0-9]{1,10}")


class Sockets:
    """Owns the connections of one program; the host closes them when the program has ended."""

    def __init__(self, *, slice_s: float) -> None:
        self._slice_s = slice_s
        self._connections: dict[str, Connection] = {}

    @property
    def builtins(self) -> Builtins:
        """The functions by their URScript names."""
        return {
            "socket_open": self._open,
            "socket_close": self._close,
            "socket_get_var": self._get_var,
            "socket_set_var": self._set_var,
            "socket_read_ascii_float": self._read_ascii_float,
            "socket_read_binary_integer": self._read_binary_integer,
            "socket_read_byte_list": self._read_byte_list,
            "socket_read_line": self._read_line,
            "socket_read_string": self._read_string,
            "socket_send_byte": self._send_byte,
            "socket_send_int": self._send_int,
            "socket_send_line": self._send_line,
            "socket_send_string": self._send_string,
        }

    def close(self) -> None:
        """Close all connections."""
        for connection in self._connections.values():
            connection.close()
        self._connections.clear()

    def _open(self, address: Value, port: Value, socket_name: Value = _FIRST) -> _Waiting[Value]:
        name = text(socket_name)
        self._close(name)
        if len(self._connections) >= N_CONNECTIONS:
            return False
        try:
            connection = self._connections[name] = Connection(text(address), integer(port))
        except OSError:
            return False
        for _ in range(slices_in(_OPEN_TIMEOUT_S, self._slice_s)):
            if connection.is_open():
                return True
            if connection.is_lost:
                break
            yield Wait.OUTSIDE
        self._close(name)
        return False

    def _close(self, socket_name: Value = _FIRST) -> Value:
        connection = self._connections.pop(text(socket_name), None)
        if connection is not None:
            connection.close()
        return None

    def _send(self, message: bytes, socket_name: Value) -> bool:
        connection = self._connections.get(text(socket_name))
        return connection is not None and connection.send(message)

    def _send_string(self, str: Value, socket_name: Value = _FIRST) -> Value:
        return self._send(_bytes_of(str), socket_name)

    def _send_line(self, str: Value, socket_name: Value = _FIRST) -> Value:
        return self._send(_bytes_of(str) + b"\n", socket_name)

    def _send_byte(self, value: Value, socket_name: Value = _FIRST) -> Value:
        return self._send(bytes([integer(value) & 0xFF]), socket_name)

    def _send_int(self, value: Value, socket_name: Value = _FIRST) -> Value:
        return self._send(struct.pack(">i", int32(integer(value))), socket_name)

    def _await(
        self, socket_name: Value, timeout_s: float, take: Callable[[Connection], T | None]
    ) -> _Waiting[T | None]:
        """Ask the connection once a slice until it gives, the time is up or it is lost."""
        n_slices = slices_in(timeout_s, self._slice_s)
        n_waited = 0
        while (connection := self._connections.get(text(socket_name))) is not None:
            taken = take(connection)
            if taken is not None or connection.is_lost or (n_slices and n_waited >= n_slices):
                return taken
            n_waited += 1
            yield Wait.OUTSIDE
        return None

    def _read_string(
        self,
        socket_name: Value = _FIRST,
        prefix: Value = "",
        suffix: Value = "",
        interpret_escape: Value = False,
        timeout: Value = 2,
    ) -> _Waiting[Value]:
        begin, end = text(prefix).lstrip(" "), text(suffix).lstrip(" ")
        if flag(interpret_escape):
            begin, end = (mark.replace("\\n", "\n").replace("\\r", "\r").replace("\\t", "\t") for mark in (begin, end))

        def take(connection: Connection) -> bytes | None:
            if not begin and not end:
                return connection.take_any(_N_TEXT_MAX)
            return connection.take_between(begin.encode("latin-1"), end.encode("latin-1"))

        taken = yield from self._await(socket_name, as_number(timeout), take)
        return (taken or b"")[:_N_TEXT_MAX].decode("latin-1")

    def _read_line(self, socket_name: Value = _FIRST, timeout: Value = 2) -> _Waiting[Value]:
        line = yield from self._await(
            socket_name, as_number(timeout), lambda connection: connection.take_through(b"\n")
        )
        return (line or b"").rstrip(b"\r\n").decode("latin-1")

    def _read_binary_integer(self, number: Value, socket_name: Value = _FIRST, timeout: Value = 2) -> _Waiting[Value]:
        n = _count(number)
        taken = yield from self._await(socket_name, as_number(timeout), lambda connection: connection.take(4 * n))
        return [0, *[-1] * n] if taken is None else [n, *struct.unpack(f">{n}i", taken)]

    def _read_byte_list(self, number: Value, socket_name: Value = _FIRST, timeout: Value = 2) -> _Waiting[Value]:
        n = _count(number)
        taken = yield from self._await(socket_name, as_number(timeout), lambda connection: connection.take(n))
        return [0, *[-1] * n] if taken is None else [n, *taken]

    def _read_ascii_float(self, number: Value, socket_name: Value = _FIRST, timeout: Value = 2) -> _Waiting[Value]:
        """Read "(1.5, 2, 3)"; the count in front says how many of the numbers came."""
        n = _count(number)
        taken = yield from self._await(
            socket_name, as_number(timeout), lambda connection: connection.take_match(_PARENTHESES)
        )
        found = _floats((taken or b"()")[1:-1].decode("latin-1"))[:n]
        return [len(found), *found, *[math.nan] * (n - len(found))]

    def _set_var(self, name: Value, value: Value, socket_name: Value = _FIRST) -> Value:
        return self._send(f"SET {text(name)} {integer(value)}\n".encode("latin-1"), socket_name)

    def _get_var(self, name: Value, socket_name: Value = _FIRST) -> _Waiting[Value]:
        """Ask for a variable and read the answer, "name value"; 0 where none comes."""
        self._send(f"GET {text(name)}\n".encode("latin-1"), socket_name)
        answer = yield from self._read_line(socket_name)
        words = text_of(answer).split()
        return _whole(words[1]) if len(words) == 2 and words[0] == name else 0


def _bytes_of(value: Value) -> bytes:
    return text_of(value).encode("latin-1", errors="replace")


def _whole(word: str) -> int:
    """Return an integer of 32 bits; 0 where the word is none: no script can hold a longer one."""
    found = int(word) if _WHOLE.fullmatch(word) else 0
    return found if found == int32(found) else 0


def _count(value: Value) -> int:
    n = integer(value)
    if not 1 <= n <= _N_NUMBERS_MAX:
        raise ValueError(f"expected to read 1 to {_N_NUMBERS_MAX} numbers, got {n}")
    return n


def _floats(listed: str) -> list[Value]:
    found: list[Value] = []
    for part in listed.split(",", _N_NUMBERS_MAX)[:_N_NUMBERS_MAX]:
        try:
            found.append(float(part))
        except ValueError:
            return found
    return found
