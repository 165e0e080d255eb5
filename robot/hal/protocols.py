"""The doors to a world: Plant, Arm, Camera, truth, resetter. Consumers own these; implementations do not inherit."""

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from robot.frames import CameraSpec, Frame
from robot.messages import ArmCommand, ArmSpec, ArmState, PlantIdentity, SceneState

__all__ = ["Arm", "Camera", "Clock", "Frame", "Linked", "Plant", "Resetter", "SceneTruth"]


class Clock(Protocol):
    """The arm's time. Waiting sleeps on a real arm and advances physics on the twin."""

    def now_ns(self) -> int:
        """Return the monotonic time of the arm in nanoseconds."""
        ...

    def wait_tick(self) -> int:
        """Wait for the next tick of the absolute grid and return how many ticks were missed."""
        ...


class Camera(Protocol):
    """A source of frames."""

    @property
    def spec(self) -> CameraSpec:
        """What it is, readable before connecting."""
        ...

    def connect(self) -> None:
        """Acquire the camera. Raises WireError where there is none."""
        ...

    def read(self, now_ns: int) -> Frame | None:
        """Return the newest frame that has arrived by now_ns and was not returned before, or None."""
        ...

    def close(self) -> None:
        """Release the camera. Idempotent, never raises."""
        ...


class SceneTruth(Protocol):
    """Ground truth of a simulated world."""

    def read(self) -> SceneState:
        """Return the poses of everything the scenario names."""
        ...


class Resetter(Protocol):
    """Brings the table back to a drawn start: teleport on a twin, a person or the arm itself elsewhere."""

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Lay the table out for an epoch, lamps and lids as digital_out says. Clears no latch by itself."""
        ...


class Arm(Protocol):
    """One arm with its hand and its digital inputs and outputs."""

    spec: ArmSpec
    clock: Clock

    def connect(self) -> None:
        """Acquire the arm. Never moves arm or fingers, never stops a program."""
        ...

    def engage(self) -> None:
        """Take command, after somebody has armed: from here on `write` moves. The arm itself moves not yet.

        Raises SafetyError where the arm is not ready or is somebody else's. Needed again after every stop; else it
        changes nothing.
        """
        ...

    def read(self) -> ArmState:
        """Return the newest state. Raises StaleStateError past its deadline."""
        ...

    def write(self, command: ArmCommand) -> None:
        """Send one command. Only the gate calls this."""
        ...

    def stop(self) -> bool:
        """Stop arm and fingers; return whether the plant confirmed. Idempotent, never raises.

        A hand that holds something goes on holding it, with the force that it has.

        Where it did not confirm nobody may speak to the arm again: the process that holds it must end.
        """
        ...

    def close(self) -> None:
        """Release the arm. Idempotent, never raises."""
        ...


class Plant(Protocol):
    """One world, real or simulated; a rig names exactly one."""

    @property
    def identity(self) -> PlantIdentity:
        """Which world this is."""
        ...

    @property
    def arm(self) -> Arm:
        """The arm with its clock."""
        ...

    @property
    def cameras(self) -> Mapping[str, Camera]:
        """Cameras by name."""
        ...

    @property
    def truth(self) -> SceneTruth | None:
        """Ground truth, where there is any."""
        ...

    @property
    def resetter(self) -> Resetter:
        """What lays the table out."""
        ...


@runtime_checkable
class Linked(Protocol):
    """A plant whose client would go on by itself after a loss of its link: the process that holds it has to end."""

    def end_by(self, end: Callable[[], object]) -> None:
        """Have this process ended by `end`, called from any thread, once the link is lost where nobody ticks."""
        ...

    def abandon(self) -> None:
        """Stop what may still be spoken to, before this process ends. From any thread; never raises."""
        ...

    def tell_upload(self, tell: Callable[[], object]) -> None:
        """Have `tell` called before the first thing is sent that the arm would run."""
        ...

    def heed(self, is_stopped: Callable[[], bool]) -> None:
        """Have this asked while command is taken, which takes seconds: somebody may say stop meanwhile."""
        ...
