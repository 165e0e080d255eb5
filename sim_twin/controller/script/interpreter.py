"""Runs a program slice by slice. It knows no clock: whoever calls `step` 500 times a second is the clock."""

import enum
from collections.abc import Mapping

from sim_twin.controller.script.code import Builtins, Code, Signal, Slow
from sim_twin.controller.script.context import Context, Scope
from sim_twin.controller.script.errors import ScriptFault, ScriptRuntimeError
from sim_twin.controller.script.names import check_names
from sim_twin.controller.script.statements import compile_body, compile_routine
from sim_twin.controller.script.syntax import Definition, Place, Program
from sim_twin.controller.script.threads import Meter, ProgramHalted, Scheduler, Steps
from sim_twin.controller.script.values import Value, copied

__all__ = ["DEFAULT_SLICE_BUDGET", "Interpreter", "Status"]

DEFAULT_SLICE_BUDGET = 40_000
"""What a program may spend in one slice, all its threads together: some four milliseconds of Python."""


class Status(enum.StrEnum):
    """What became of a program."""

    RUNNING = "running"
    FINISHED = "finished"
    FAILED = "failed"


class Interpreter:
    """One run of one program. Making it compiles the program, so make it off the loop.

    Attributes:
        status: What became of the program; it runs from the start.
        error: Why it failed, or None.
    """

    def __init__(
        self,
        program: Program,
        builtins: Builtins,
        *,
        slice_budget: int = DEFAULT_SLICE_BUDGET,
        variables: Mapping[str, Value] | None = None,
        costs: Mapping[str, int] | None = None,
    ) -> None:
        """Compile.

        Args:
            program: What to run.
            builtins: The functions that the robot offers. One that takes time is a generator function: each yield
                takes the rest of the thread's slice, and what it returns is the call's value. A TypeError, ValueError,
                LookupError, ArithmeticError or ScriptRuntimeError that one raises ends the program
                as the script's mistake, any other exception as the controller's.
            slice_budget: What the program may spend in one slice, all threads together; see costs.py.
            variables: Global variables that exist before the program begins.
            costs: What a call of each builtin costs; one that is not there costs what most do.

        Raises:
            ScriptNameError: the program uses a name that nothing has.
        """
        self.status = Status.RUNNING
        self.error: ScriptFault | None = None
        self._program = program
        self._meter = Meter()
        may_take_time = not program.is_secondary
        self._scheduler = Scheduler(self._meter, slice_budget=slice_budget, may_take_time=may_take_time)
        check_names(program, builtins=builtins, variables=variables or ())
        self._context = context = Context(
            program,
            builtins=builtins,
            scheduler=self._scheduler,
            meter=self._meter,
            variables={name: copied(value) for name, value in (variables or {}).items()},
            costs=costs or {},
        )
        definition = Definition(Place(1, 1), program.name, False, (), program.body)
        scope = Scope(context, definition, None, is_main=True)
        body = compile_body(scope)
        while context.to_compile:
            compile_routine(context.to_compile.pop())
        self._main = self._scheduler.start_main(program.name, _work(body))

    @property
    def line(self) -> int:
        """The line that the main thread is at."""
        return self._main.place.line

    def step(self) -> Status:
        """Run one slice of every thread and return the status."""
        if self.status is not Status.RUNNING:
            return self.status
        try:
            self._scheduler.step()
        except ProgramHalted:
            self._end(Status.FINISHED)
        except ScriptRuntimeError as error:
            self._fail(str(error))
        except RecursionError:
            self._fail("calls and expressions are nested too deep")
        except Exception as error:  # noqa: BLE001 - whatever a program brings about, the controller outlives it
            self._fail(f"the controller failed at this, not the program: {error!r}")
        else:
            if not self._main.is_alive:
                self._end(Status.FINISHED)
        return self.status

    def stop(self) -> None:
        """End the program and all its threads."""
        if self.status is Status.RUNNING:
            self._end(Status.FINISHED)

    def _fail(self, message: str) -> None:
        thread = self._scheduler.running or self._main
        line, column = self._meter.place
        self.error = ScriptFault(message=message, line=line, column=column, thread=thread.name)
        self._end(Status.FAILED)

    def _end(self, status: Status) -> None:
        self.status = status
        try:
            self._scheduler.stop()
        except Exception as error:  # noqa: BLE001 - as in step
            if self.error is None:
                self._fail(f"the controller failed to end this: {error!r}")
        self._context.forget()


def _work(body: Code[Signal | None]) -> Steps[object]:
    if isinstance(body, Slow):
        yield from body.run([None])
    else:
        body.run([None])
