"""The programs: one that moves the arm, secondary ones beside it, and those on the shelf. Stepped once a slice.

A secondary program ends in its slice, or fails there, and has the slice to itself: each may spend a whole budget, and a
flood of them must not hold the controller's loop.
"""

from collections import deque

from sim_twin.controller.compiling import Compiled, Compiler, Mistake, Start
from sim_twin.controller.machine import Machine
from sim_twin.controller.script import Status
from sim_twin.controller.states import Event, ProgramOrder, Reaction, RobotMode, RuntimeState
from sim_twin.controller.wire.script_framer import N_PROGRAM_CHARS

__all__ = ["UNNAMED", "Programs"]

UNNAMED = "unnamed"
SECONDARY = "SECONDARY_PROGRAM_EXCEPTION_XXX"
"""What a robot puts before the reason for which a secondary program failed."""
BEYOND = "the arm is beyond a limit or a plane (recovery mode); jog it back first"
STOPPED_BEFORE = "it was stopped before it began"
_TAKES_BACK = frozenset(Event) - {
    Event.PLAY, Event.PAUSE, Event.STOP, Event.PROGRAM_ENDED, Event.REDUCED, Event.REDUCED_ENDED,
    Event.RECOVERED,
}  # fmt: skip
"""After a stop, a loss of power and the way back from them nothing may begin that was sent before, or the arm would
move by itself once somebody has released a button. What a program or its watchdog brings about is not among them."""
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
        self._n_stops = {True: 0, False: 0}
        """By whether the texts that they take back are remote."""

    @property
    def line(self) -> int:
        """The line that the program is at; 0 where none runs."""
        return 0 if self.main is None else self.main.interpreter.line

    @property
    def is_empty(self) -> bool:
        """No program runs, waits or is being made."""
        return self.main is None and self._next is None and not self._secondary and self._compiler.is_idle

    @property
    def refusal(self) -> str | None:
        """Why no program could start now, whatever runs; None where one could."""
        modes = self._machine.modes
        if modes.robot is RobotMode.RUNNING and not modes.is_stopped_by_safety:
            return None
        return f"no program can start in mode {modes.robot.name}, safety mode {modes.safety.name}"

    def submit(self, text: str, *, is_remote: bool = False, is_by_hand: bool = False) -> Start:
        """Take a program's text: a `def` replaces the one that runs, a `sec` runs beside it. Tells what comes of it.

        Args:
            text: The program.
            is_remote: It came from elsewhere, under remote control.
            is_by_hand: Somebody at the arm moves it so, which works in the recovery mode too.
        """
        start = Start(n_stops=self._n_stops[is_remote], is_remote=is_remote, is_by_hand=is_by_hand)
        if len(text) > N_PROGRAM_CHARS:
            too_long = f"expected a program of at most {N_PROGRAM_CHARS} characters, got {len(text)}"
            self._take(Mistake(message=too_long), start)
            return start
        self.last_text = text
        self._compiler.submit(text, start)
        return start

    def refuse(self, why: str) -> None:
        """Say why there is no program to take."""
        self._take(Mistake(message=why), Start())

    def stop(self) -> Reaction:
        """Stop what runs and let nothing start that was sent before, compiled or not. Secondary programs go on.

        So somebody stops the robot. A program that stops itself, starves or is replaced takes none with it.
        """
        self._take_back()
        return self.handle(Event.STOP)

    def pause(self) -> Reaction:
        """Pause what runs, and let nothing take its place that was sent before."""
        reaction = self.handle(Event.PAUSE)
        if reaction.refusal is None:
            self._take_back()
        return reaction

    def turn_remote(self, on: bool) -> None:
        """Turn to remote or to local control, in which no program starts that was sent under remote control."""
        self._machine.modes.is_remote = on
        if not on:
            self._take_back(is_local_too=False)

    def handle(self, event: Event, *, joint: int | None = None) -> Reaction:
        """Let an event happen: modes, arm and program."""
        reaction = self._machine.modes.handle(event, joint=joint)
        if event in _TAKES_BACK and reaction.refusal is None:
            self._take_back()
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
        elif done.is_secondary and start.is_remote and not self._machine.modes.is_remote:
            self._turn_down(done, start, "the robot was turned to local control")
        elif done.is_secondary and len(self._secondary) >= N_SECONDARY:
            self._turn_down(done, start, f"{N_SECONDARY} secondary programs wait for their slice")
        elif done.is_secondary:
            self._secondary.append(done)
            start.has_begun = True
        elif start.n_stops < self._n_stops[start.is_remote]:
            self._turn_down(done, start, STOPPED_BEFORE)
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
        is_closed = self._machine.modes.is_recovering and not start.is_by_hand
        refusal = BEYOND if is_closed else self.handle(Event.PLAY).refusal
        if refusal is not None:
            self._turn_down(program, start, refusal)
            return
        start.has_begun = True
        self.main = program
        self._machine.begin_program()
        self._machine.journal.key("PROGRAM_XXX_STARTED", program.name or UNNAMED)

    def _take_back(self, *, is_local_too: bool = True) -> None:
        """Let nothing start that was sent before, compiled or not."""
        for is_remote in (True, False) if is_local_too else (True,):
            self._n_stops[is_remote] += 1
        if self._next is not None and self._next[1].n_stops < self._n_stops[self._next[1].is_remote]:
            self._turn_down(*self._next, STOPPED_BEFORE)
            self._next = None

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
