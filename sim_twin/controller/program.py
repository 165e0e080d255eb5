"""The programs: one that moves the arm, secondary ones beside it, and those on the shelf. Stepped once a slice.

A secondary program ends in its slice, or fails there, and has the slice to itself: each may spend a whole budget, and a
flood of them must not hold the controller's loop.
"""

from collections import deque

from sim_twin.controller.compiling import Compiled, Compiler, Mistake, Start
from sim_twin.controller.machine import Machine
from sim_twin.controller.script import Status
from sim_twin.controller.states import Event, ProgramOrder, Reaction, RuntimeState

__all__ = ["UNNAMED", "Programs"]

UNNAMED = "unnamed"
SECONDARY = "SECONDARY_PROGRAM_EXCEPTION_XXX"
"""What a robot puts before the reason for which a secondary program failed."""
N_SECONDARY = 1000
"""Secondary programs that wait; one more is turned away, or a flood would fill the memory."""


class Programs:
    """Owns what runs. Every event of the modes goes through here, for most of them stop or pause a program.

    Args:
        machine: What programs act on.
        compiler: Makes programs of texts.

    Attributes:
        main: The program that runs or is paused.
        shelf: Programs that can be loaded by path.
        loaded: Path of the loaded one.
        last_text: What was submitted last.
    """

    def __init__(self, machine: Machine, compiler: Compiler) -> None:
        self._machine = machine
        self._compiler = compiler
        self.main: Compiled | None = None
        self.shelf: dict[str, str] = {}
        self.loaded: str | None = None
        self.last_text = ""
        self._next: tuple[Compiled, Start] | None = None
        self._secondary = deque[Compiled]()
        self._n_stops = 0

    @property
    def line(self) -> int:
        """The line that the program is at; 0 where none runs."""
        return 0 if self.main is None else self.main.interpreter.line

    def submit(self, text: str) -> Start:
        """Take a program's text: a `def` replaces the one that runs, a `sec` runs beside it. Tells what comes of it."""
        self.last_text = text
        start = Start(n_stops=self._n_stops)
        self._compiler.submit(text, start)
        return start

    def stop(self) -> Reaction:
        """Stop what runs and let nothing start that was sent before, compiled or not. Secondary programs go on.

        So somebody stops the robot. A program that stops itself, starves or is replaced takes none with it.
        """
        self._n_stops += 1
        if self._next is not None:
            self._turn_down(*self._next, "it was stopped before it began")
            self._next = None
        return self.handle(Event.STOP)

    def handle(self, event: Event, *, joint: int | None = None) -> Reaction:
        """Let an event happen: modes, arm and program."""
        reaction = self._machine.modes.handle(event, joint=joint)
        self._machine.note_safety(event, joint)
        self.obey(reaction)
        return reaction

    def obey(self, reaction: Reaction) -> None:
        """Do what the modes ask of arm and program."""
        self._machine.drive.obey(reaction.motion)
        if reaction.program is ProgramOrder.STOP and self.main is not None:
            self._end_main()

    def step(self) -> None:
        """Run one slice of everything that may run."""
        machine = self._machine
        while (done := self._compiler.take()) is not None:
            self._take(*done)
        if self._next is not None:
            self._replace(*self._next)
        if self.main is not None and machine.modes.may_move:
            status = self.main.interpreter.step()
            if status is not Status.RUNNING:
                self._finish(self.main)
        if self._secondary and not self._step_beside(self._secondary[0]):
            self._secondary.popleft()
        while machine.posted:
            self.handle(machine.posted.popleft())

    def close(self) -> None:
        """End all programs and their connections."""
        self._compiler.close()
        waiting = None if self._next is None else self._next[0]
        for program in (self.main, waiting, *self._secondary):
            if program is not None:
                program.close()
        self.main, self._next = None, None
        self._secondary.clear()

    def _take(self, done: Compiled | Mistake, start: Start) -> None:
        if isinstance(done, Mistake):
            self._machine.journal.exception(
                program=UNNAMED,
                thread="compiler",
                line=done.line,
                column=done.column,
                message=done.message,
                as_reported=done.as_reported,
            )
            start.has_begun = False
        elif done.is_secondary and len(self._secondary) >= N_SECONDARY:
            self._turn_down(done, start, f"{N_SECONDARY} secondary programs wait for their slice")
        elif done.is_secondary:
            self._secondary.append(done)
            start.has_begun = True
        elif start.n_stops < self._n_stops:
            self._turn_down(done, start, "it was stopped before it began")
        else:
            if self._next is not None:
                self._turn_down(*self._next, "another came before it began")
            self._next = done, start

    def _replace(self, program: Compiled, start: Start) -> None:
        """Stop what runs, and start once it has stopped."""
        runtime = self._machine.modes.runtime
        if runtime not in (RuntimeState.STOPPING, RuntimeState.STOPPED):
            self.handle(Event.STOP)
        if runtime is not RuntimeState.STOPPED:
            return
        self._next = None
        refusal = self.handle(Event.PLAY).refusal
        if refusal is not None:
            self._turn_down(program, start, refusal)
            return
        start.has_begun = True
        self.main = program
        self._machine.begin_program()
        self._machine.journal.key("PROGRAM_XXX_STARTED", program.name or UNNAMED)

    def _turn_down(self, program: Compiled, start: Start, why: str) -> None:
        program.close()
        start.has_begun = False
        self._machine.journal.note(f"program {program.name or UNNAMED} was not started: {why}")

    def _finish(self, program: Compiled) -> None:
        """Come to rest after a program's end; say why, where it failed."""
        fault = program.interpreter.error
        if fault is not None:
            self._machine.journal.exception(
                program=program.name or UNNAMED,
                thread=fault.thread,
                line=fault.line,
                column=fault.column,
                message=fault.message,
            )
        core = self._machine.drive.core
        core.tail = None
        core.end_force_mode()
        core.end_freedrive()
        self._end_main()
        self.handle(Event.PROGRAM_ENDED)

    def _end_main(self) -> None:
        program, self.main = self.main, None
        if program is None:
            return
        program.close()
        self._machine.watchdogs.clear()
        self._machine.journal.key("PROGRAM_XXX_STOPPED", program.name or UNNAMED)

    def _step_beside(self, program: Compiled) -> bool:
        """Run a slice of a secondary program and return whether it goes on."""
        if program.interpreter.step() is Status.RUNNING:
            return True
        fault = program.interpreter.error
        if fault is not None:
            self._machine.journal.exception(
                program=program.name,
                thread=fault.thread,
                line=fault.line,
                column=fault.column,
                message=fault.message,
                as_reported=f"{SECONDARY}{fault.message}",
            )
        program.sockets.close()
        return False
