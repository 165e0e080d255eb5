"""URScript: the language that a controller's clients upload, parsed and run in slices.

program = parse_program(text)
interpreter = Interpreter(program, builtins)
while interpreter.step() is Status.RUNNING:
    ...  # one control period of the robot
"""

from sim_twin.controller.script.code import Builtin, Builtins
from sim_twin.controller.script.errors import (
    ScriptError,
    ScriptFault,
    ScriptNameError,
    ScriptRuntimeError,
    ScriptSyntaxError,
)
from sim_twin.controller.script.interpreter import DEFAULT_SLICE_BUDGET, Interpreter, Status
from sim_twin.controller.script.parser import parse_program
from sim_twin.controller.script.syntax import Program
from sim_twin.controller.script.values import ScriptStruct, Value, text_of

__all__ = [
    "DEFAULT_SLICE_BUDGET",
    "Builtin",
    "Builtins",
    "Interpreter",
    "Program",
    "ScriptError",
    "ScriptFault",
    "ScriptNameError",
    "ScriptRuntimeError",
    "ScriptStruct",
    "ScriptSyntaxError",
    "Status",
    "Value",
    "parse_program",
    "text_of",
]
