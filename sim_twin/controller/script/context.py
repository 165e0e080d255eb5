"""What compiled code of one program shares, and where each name of a function lives."""

import inspect
from collections.abc import Mapping

from sim_twin.controller.script.arithmetic import binary_operators, unary_operators
from sim_twin.controller.script.code import UNSET, Builtin, Builtins, Code, Frame, Signal
from sim_twin.controller.script.costs import BUILTIN, CALL, copier
from sim_twin.controller.script.scopes import (
    Functions,
    assigned_names,
    definitions_in,
    global_names,
    slow_functions,
)
from sim_twin.controller.script.syntax import Definition, Program
from sim_twin.controller.script.threads import Meter, Scheduler
from sim_twin.controller.script.values import Value

__all__ = ["Context", "Routine", "Scope", "takes_time"]


def takes_time(builtin: Builtin) -> bool:
    """Return whether a builtin is a generator function, whose call takes a slice at each yield."""
    call = builtin if inspect.isroutine(builtin) else getattr(builtin, "__call__", builtin)  # noqa: B004
    return inspect.isgeneratorfunction(builtin) or inspect.isgeneratorfunction(call)


class Context:
    """One program being run.

    Attributes:
        builtins: What the host offers.
        meter: Place and budget of the running thread.
        scheduler: The threads.
        copied: Copies a value and takes the cost off the meter.
        binary: Operators by their symbols, which do so too.
        unary: Likewise, before one operand.
        globals: Values of the global variables.
        global_places: Where in it each is.
        slow: Names of the program's functions that can take time.
        to_compile: Functions that are called but not compiled yet; one after another, so that a long chain of calls
            needs no deep stack.
    """

    def __init__(
        self,
        program: Program,
        *,
        builtins: Builtins,
        scheduler: Scheduler,
        meter: Meter,
        variables: Mapping[str, Value],
        costs: Mapping[str, int],
    ) -> None:
        self.builtins = builtins
        self.meter = meter
        self._costs = costs
        self.copied = copier(meter.spend)
        self.binary, self.unary = binary_operators(meter.spend), unary_operators(meter.spend)
        self.scheduler = scheduler
        self.global_places = {name: i for i, name in enumerate(sorted(global_names(program) | variables.keys()))}
        self.globals: Frame = [variables.get(name, UNSET) for name in self.global_places]
        self.slow = slow_functions(program, {name for name, builtin in builtins.items() if takes_time(builtin)})
        self._signatures: dict[str, inspect.Signature | None] = {}
        self._routines: dict[int, Routine] = {}
        self.to_compile: list[Routine] = []

    def routine(self, definition: Definition, around: Functions) -> "Routine":
        """Return a function or thread, which from then on waits to be compiled."""
        known = self._routines.get(id(definition))
        if known is None:
            known = Routine(definition, Scope(self, definition, around, is_main=False))
            self._routines[id(definition)] = known
            self.to_compile.append(known)
        return known

    def forget(self) -> None:
        """Drop the code of all functions, once nothing runs any more.

        Code and functions hold one another; left to the garbage collector, a program would cost it hundreds of
        milliseconds in which nothing else runs.
        """
        for routine in self._routines.values():
            routine.body = None
            routine.defaults.clear()
        self._routines.clear()

    def cost(self, name: str) -> int:
        """Return what a call of a builtin costs, beside its arguments and what it returns."""
        return self._costs.get(name, BUILTIN)

    def signature(self, name: str) -> inspect.Signature | None:
        """Return a builtin's signature, or None where Python knows none; to look it up takes as long as ten calls."""
        if name not in self._signatures:
            try:
                self._signatures[name] = inspect.signature(self.builtins[name])
            except ValueError:
                self._signatures[name] = None
        return self._signatures[name]


class Scope:
    """Where one function's names live.

    Attributes:
        context: Of the program.
        body: The statements.
        functions: What it can call.
        places: Where in the frame its own variables are.
        is_open: Those of them that stand for the global of the same name while that exists.
    """

    def __init__(self, context: Context, definition: Definition, around: Functions | None, *, is_main: bool) -> None:
        self.context = context
        self.body = body = definition.body
        self.functions = Functions(definitions_in(body), around)
        parameters = [parameter.name for parameter in definition.parameters]
        own = dict.fromkeys(parameters) | dict.fromkeys(sorted(assigned_names(body, "local")))
        declared = assigned_names(body, "global")
        free = sorted(assigned_names(body) - own.keys() - declared)
        names = [] if is_main else [*own, *free]
        self.places = {name: 1 + i for i, name in enumerate(names)}
        self.is_open = {name for name in free if name in context.global_places}

    def find(self, name: str) -> tuple[Definition, Functions] | None:
        """Return the function or thread that a name calls here, and among which functions it is defined."""
        level: Functions | None = self.functions
        while level is not None:
            if name in level.own:
                return level.own[name], level
            level = level.around
        return None

    def is_slow(self, name: str) -> bool:
        """Return whether a call of the name can take time."""
        if self.find(name) is not None:
            return name in self.context.slow
        builtin = self.context.builtins.get(name)
        return builtin is not None and takes_time(builtin)


class Routine:
    """A function or thread.

    Attributes:
        definition: From the tree.
        scope: Of its body.
        body: Its code, set once compiled; a recursive call finds it there when it runs.
        defaults: Code of the parameters' defaults, likewise.
        cost: Of a call.
    """

    def __init__(self, definition: Definition, scope: Scope) -> None:
        self.definition = definition
        self.scope = scope
        self.body: Code[Signal | None] | None = None
        self.defaults: dict[str, Code[Value]] = {}
        self.cost = CALL + len(scope.places) // 8
        self._blank: Frame = [None, *[UNSET] * len(scope.places)]

    def frame(self) -> Frame:
        """Return a frame whose variables have no values; without a return the function's value is None."""
        return self._blank.copy()
