"""The built-in functions that need no robot. A host adds its own and hands all of them to an interpreter.

    builtins = {**PURE, **time_builtins(slice_s=0.002), **message_builtins(log), **sockets.builtins, **robot}

An argument that does not fit raises TypeError or ValueError; the interpreter adds the function's name and the line.
"""

from sim_twin.controller.script.builtins.arguments import (
    flag,
    integer,
    matrix,
    number,
    numbers,
    pose,
    text,
    values,
    vector,
)
from sim_twin.controller.script.builtins.connection import Connection
from sim_twin.controller.script.builtins.lists import LISTS
from sim_twin.controller.script.builtins.maths import MATHS
from sim_twin.controller.script.builtins.poses import POSES
from sim_twin.controller.script.builtins.sockets import Sockets
from sim_twin.controller.script.builtins.strings import STRINGS
from sim_twin.controller.script.builtins.waiting import Messages, Popup, message_builtins, slices_in, time_builtins
from sim_twin.controller.script.code import Builtins

__all__ = [
    "PURE",
    "Connection",
    "Messages",
    "Popup",
    "Sockets",
    "flag",
    "integer",
    "matrix",
    "message_builtins",
    "number",
    "numbers",
    "pose",
    "slices_in",
    "text",
    "time_builtins",
    "values",
    "vector",
]

PURE: Builtins = {**MATHS, **LISTS, **STRINGS, **POSES}
