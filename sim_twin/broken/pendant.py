"""What a person does at a controller after a stop: looks, releases, powers up. Nothing here is part of the backend."""

import socket
from collections.abc import Callable
from time import monotonic, sleep

from sim_twin.controller.process import ask_fault
from sim_twin.controller.wire.wires import DASHBOARD, SCRIPTS

__all__ = ["Pendant"]

ANSWER_S, AWAIT_S = 5.0, 20.0


class Pendant:
    """The dashboard of the virtual controller at a host, by hand.

    Args:
        host: the controller's address.
    """

    def __init__(self, host: str) -> None:
        self.host = host

    def say(self, *lines: str) -> list[str]:
        """Send lines and return the answers."""
        with socket.create_connection((self.host, DASHBOARD), timeout=ANSWER_S) as connection:
            heard = connection.makefile("rb")
            heard.readline()
            answers = []
            for line in lines:
                connection.sendall(line.encode() + b"\n")
                answers.append(heard.readline().decode().strip())
            return answers

    def run(self, script: str) -> None:
        """Have the controller run a script, as anybody may who reaches its port."""
        with socket.create_connection((self.host, SCRIPTS), timeout=ANSWER_S) as connection:
            connection.sendall(script.encode())
            connection.recv(64)  # it was read, with the state that the port gives everybody

    def unlock(self) -> None:
        """Release a protective stop, as soon as the controller lets a person do it: 5 s of its own time."""
        self.say("close safety popup")
        self._await(lambda: self.say("unlock protective stop") == ["Protective stop releasing"])
        self._await(lambda: ask_fault(self.host, "truth")["safety_mode"] == "NORMAL")

    def restart(self) -> None:
        """Restart safety after a violation or a fault, then power up."""
        self.say("close safety popup", "restart safety")
        self.power_up()

    def power_up(self) -> None:
        """Power on and release the brakes; return when the arm runs."""
        self._await(lambda: self.mode() == "POWER_OFF")
        self.say("power on")
        self._await(lambda: self.mode() == "IDLE")
        self.say("brake release")
        self._await(lambda: self.mode() == "RUNNING")

    def mode(self) -> str:
        """Return the robot mode."""
        return str(ask_fault(self.host, "truth")["robot_mode"])

    def _await(self, is_so: Callable[[], bool]) -> None:
        end_s = monotonic() + AWAIT_S
        while not is_so():
            if monotonic() > end_s:
                raise TimeoutError(f"expected the controller to come up within {AWAIT_S:g} s, it is {self.mode()}")
            sleep(0.1)
