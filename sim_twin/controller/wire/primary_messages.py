"""The robot messages of port 30001 as bytes: a time stamp, a source, a type and what is said. Pure."""

import struct
from enum import IntEnum

from sim_twin.controller.wire.primary import pack_package
from sim_twin.controller.wire.version import ControllerVersion

__all__ = [
    "ReportLevel",
    "Source",
    "pack_error_code",
    "pack_key",
    "pack_popup",
    "pack_runtime_exception",
    "pack_safety_mode",
    "pack_text",
    "pack_version",
]

_ROBOT_MESSAGE = 20
_N_TITLE_BYTES = 255
_HEAD = struct.Struct(">QbB")
_VERSION = struct.Struct(">BBii")
_ERROR_CODE = struct.Struct(">3i2I")
_KEY = struct.Struct(">2i")
_POPUP = struct.Struct(">IB3?")
_SAFETY_MODE = struct.Struct(">2iB2I")
_PLACE = struct.Struct(">2i")


class Source(IntEnum):
    """Which part of the controller speaks; a signed byte on the wire. Joints and boards have numbers of their own."""

    UNDEFINED = -1
    ROBOT_INTERFACE = -2
    RTMACHINE = -3
    SIMULATED_ROBOT = -4
    GUI = -5
    CONTROLLER = 7
    RTDE = 8


class ReportLevel(IntEnum):
    """How grave an error code is."""

    DEBUG = 0
    INFO = 1
    WARNING = 2
    VIOLATION = 3
    FAULT = 4
    CRITICAL_FAULT = 5


class _Type(IntEnum):
    TEXT = 0
    POPUP = 2
    VERSION = 3
    SAFETY_MODE = 5
    ERROR_CODE = 6
    KEY = 7
    RUNTIME_EXCEPTION = 10


def pack_version(version: ControllerVersion, *, stamp_us: int, build_date: str = "01-12-2021, 00:00:00") -> bytes:
    """Return the message that greets every client of 30001 and 30002."""
    numbers = _VERSION.pack(version.major, version.minor, version.bugfix, version.build)
    return _message(_Type.VERSION, stamp_us, Source.CONTROLLER, _counted("URControl") + numbers + build_date.encode())


def pack_error_code(
    code: int, argument: int = 0, *, stamp_us: int, level: ReportLevel, text: str = "", source: int = Source.CONTROLLER
) -> bytes:
    """Return an error code such as C153A1 (153, 1); UR calls it a robot communication message."""
    no_data = 0
    body = _ERROR_CODE.pack(code, argument, level, no_data, no_data) + text.encode()
    return _message(_Type.ERROR_CODE, stamp_us, source, body)


def pack_key(code: int, argument: int = 0, *, stamp_us: int, title: str, text: str) -> bytes:
    """Return a key message, such as PROGRAM_XXX_STARTED with the program's name."""
    body = _KEY.pack(code, argument) + _counted(title) + text.encode()
    return _message(_Type.KEY, stamp_us, Source.RTMACHINE, body)


def pack_popup(
    title: str, text: str, *, stamp_us: int, request_id: int = 0, is_warning: bool, is_error: bool, is_blocking: bool
) -> bytes:
    """Return a popup that asks for no value."""
    no_value = 0
    body = _POPUP.pack(request_id, no_value, is_warning, is_error, is_blocking) + _counted(title) + text.encode()
    return _message(_Type.POPUP, stamp_us, Source.RTMACHINE, body)


def pack_runtime_exception(line: int, column: int, text: str, *, stamp_us: int) -> bytes:
    """Return where a script failed, and why."""
    return _message(_Type.RUNTIME_EXCEPTION, stamp_us, Source.RTMACHINE, _PLACE.pack(line, column) + text.encode())


def pack_safety_mode(code: int, argument: int, *, stamp_us: int, safety_mode: int, report_data: int = 0) -> bytes:
    """Return a change of the safety mode."""
    no_type = 0
    body = _SAFETY_MODE.pack(code, argument, safety_mode, no_type, report_data)
    return _message(_Type.SAFETY_MODE, stamp_us, Source.RTMACHINE, body)


def pack_text(text: str, *, stamp_us: int) -> bytes:
    """Return what a script's `textmsg` says."""
    return _message(_Type.TEXT, stamp_us, Source.RTMACHINE, text.encode())


def _message(kind: _Type, stamp_us: int, source: int, body: bytes) -> bytes:
    return pack_package(_ROBOT_MESSAGE, _HEAD.pack(stamp_us, source, kind) + body)


def _counted(text: str) -> bytes:
    cut = text.encode()[:_N_TITLE_BYTES]
    return bytes([len(cut)]) + cut
