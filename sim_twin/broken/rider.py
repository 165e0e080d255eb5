"""An arm that is kept moving through the whole backend while something goes wrong with its controller."""

from collections.abc import Callable
from threading import Thread
from time import monotonic, sleep
from typing import Self

import msgspec

from config.loader import resolve
from config.resolved import Resolved
from robot.errors import RobotError
from robot.messages import ArmState, GripCommand
from robot.servo_client import ServoClient
from sim_twin.broken.shuttle import Shuttle
from sim_twin.broken.tries import DisturbedError

__all__ = ["Raised", "Rider", "wire_rig"]

STEP_TICKS = 20
NEVER_S = 3.0
"""A backend that has said nothing for so long does not notice."""


def _lost(why: str | None) -> "Raised | None":
    return None if why is None else Raised(at_s=monotonic(), what="lost", detail=why)


def _beside(
    inject: Callable[[], float], delay_s: float, do: Callable[[], "Raised | None"]
) -> tuple[float, "Raised | None"]:
    """Do something, and let something else happen a little later from another thread; return when, and what came up."""
    happened: list[float] = []

    def happen() -> None:
        sleep(delay_s)
        happened.append(inject())

    thread = Thread(target=happen)
    thread.start()
    raised = do()
    thread.join()
    return happened[0], raised


class Raised(msgspec.Struct, frozen=True, kw_only=True):
    """What a person would have been told, and when."""

    at_s: float
    """The host's monotonic time."""
    what: str
    """Error's class, or the gate's reason."""
    detail: str


def wire_rig(host: str) -> Resolved:
    """Return the rig virtual_lab for a controller at another loopback address."""
    resolved = resolve(rig="virtual_lab", scenario="paper", learning="default")
    return msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, address=host))


class Rider:
    """Moves the arm at a host by the servo process, as a learner's station does.

    Args:
        host: the controller's address.

    Attributes:
        client: the station's end of the servo process.
    """

    def __init__(self, host: str) -> None:
        self._resolved = wire_rig(host)
        self.client = ServoClient(self._resolved)
        tool = self._resolved.arm.tool
        self._grip = GripCommand(opening_m=tool.stroke_m, force_n=tool.grip_force_n, speed_m_s=tool.speed_m_s[1])
        self._shuttle = Shuttle()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.client.close()

    def take(self) -> ArmState:
        """Connect, take command as an operator allows it, and start from what is measured.

        Raises:
            RobotError: the arm is not to be had, and why.
        """
        self.client.connect()
        self.client.engage()
        self.client.begin_epoch(0)
        return self.client.seed()

    def step(self) -> Raised | None:
        """Move on for a time step; return what came up, if anything did."""
        try:
            came = self.client.stride(self._shuttle.intent, self._grip, n_ticks=STEP_TICKS)
        except RobotError as error:
            return Raised(at_s=monotonic(), what=type(error).__name__, detail=str(error))
        if came.verdict is not None:
            return Raised(at_s=monotonic(), what=came.verdict.reason, detail=came.verdict.detail)
        self._shuttle.note(came.after.tcp_position_m)
        return None

    def ride(self, seconds: float) -> Raised | None:
        """Move for a while; return what came up, if anything did."""
        end_s = monotonic() + seconds
        while monotonic() < end_s:
            raised = self.step()
            if raised is not None:
                return raised
        return None

    def ride_into(self, inject: Callable[[], float], *, wait_s: float = NEVER_S) -> tuple[float, Raised | None]:
        """Let something go wrong in the middle of the way at full speed, and ride on until something is said.

        Args:
            inject: brings it about from another thread, at no particular phase of a step; returns when it happened.
            wait_s: how long to ride on where nothing is said.

        Returns:
            When it happened, and what came up.
        """
        self._get_under_way()
        return _beside(inject, 0.013, lambda: self.ride(wait_s))

    def stop_into(self, inject: Callable[[], float]) -> tuple[float, Raised | None]:
        """Let something go wrong while the arm is being stopped from full speed; the same is returned."""
        self._get_under_way()
        return _beside(inject, 0.013, self._stop)

    def engage_into(self, inject: Callable[[], float], *, after_s: float) -> tuple[float, Raised | None]:
        """Let something go wrong so long after command was asked for; the same is returned."""
        self.take()  # the hand is activated by then, which would take its time
        self.client.stop()
        return _beside(inject, after_s, self._engage)

    def seed_into(self, inject: Callable[[], float]) -> tuple[float, Raised | None]:
        """Let something go wrong between taking command and starting from what is measured; the same is returned."""
        self.client.connect()
        self.client.engage()
        return _beside(inject, 0.0, self._seed)

    def _get_under_way(self) -> None:
        raised = self.ride(0.6)
        while raised is None and not self._shuttle.is_midway:
            raised = self.step()
        if raised is not None:
            raise DisturbedError(f"before anything went wrong: {raised}")

    def _stop(self) -> Raised | None:
        self.client.stop()
        return _lost(self.client.why_lost)

    def _engage(self) -> Raised | None:
        try:
            self.client.engage()
        except RobotError as error:
            return _lost(str(error))
        return None

    def _seed(self) -> Raised | None:
        end_s = monotonic() + NEVER_S
        while (raised := _lost(self.client.why_lost)) is None and monotonic() < end_s:
            sleep(0.005)
        return raised
