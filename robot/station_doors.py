"""What a station needs of others: of perception, of a plant besides its arm, and of what holds the arm."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from robot.hal.protocols import Camera, Resetter, SceneTruth
from robot.messages import ArmState, GripCommand, Intent, Percept, PlantIdentity, SceneState, Vec3
from robot.surroundings import Surroundings
from robot.tick_loop import Stride

if TYPE_CHECKING:
    from robot.recording.account import Account

__all__ = ["Accountable", "Holder", "Loop", "Perceives", "Sighted", "World"]


class Perceives(Protocol):
    """What the station needs of perception."""

    def perceive(self, arm: ArmState, scene: SceneState | None) -> Percept:
        """Return the percept at the arm's stamp."""
        ...


@runtime_checkable
class Sighted(Protocol):
    """A perception that looks through a plant's cameras."""

    def watch(self, cameras: Mapping[str, Camera]) -> None:
        """Take the cameras to look through."""
        ...

    def connect(self) -> None:
        """Acquire them. Raises WireError where there is none."""
        ...

    def forget(self) -> None:
        """Begin anew: the table was laid out by somebody."""
        ...

    def close(self) -> None:
        """Release them. Idempotent, never raises."""
        ...


@runtime_checkable
class Accountable(Protocol):
    """A station over which a learner can tell a recorder what it learns from."""

    def open_account(self) -> "Account":
        """Return what numbers and keeps what is told."""
        ...


class World(Protocol):
    """What the station needs of a plant, besides its arm."""

    @property
    def identity(self) -> PlantIdentity:
        """Which plant this is; known when its arm is connected."""
        ...

    @property
    def truth(self) -> SceneTruth | None:
        """Ground truth, where there is any."""
        ...

    @property
    def resetter(self) -> Resetter:
        """What lays the table out."""
        ...


class Holder(Protocol):
    """What holds the arm, in this process or in another."""

    def connect(self) -> None:
        """Acquire the arm. Moves nothing."""
        ...

    def engage(self) -> None:
        """Take command of the arm, unless it is ours already."""
        ...

    @property
    def why_lost(self) -> str | None:
        """Why command was lost between time steps since it was taken, None where it was not."""
        ...

    def stop(self) -> None:
        """Stop the arm and give up command; where it is lost that is told at once, before it rests."""
        ...

    def await_rest(self) -> None:
        """Wait until an arm that was lost must be at rest."""
        ...

    def close(self) -> None:
        """Stop and release the arm. Idempotent, never raises."""
        ...


class Loop(Holder, Protocol):
    """Who holds the arm and moves it, tick by tick."""

    def measure(self) -> ArmState:
        """Read the arm that was acquired, in command of it or not. Moves nothing."""
        ...

    @property
    def is_in_contact(self) -> bool:
        """Whether something holds the tool up."""
        ...

    def begin_epoch(self, epoch: int) -> int:
        """Take up an epoch's rules and return the outputs it begins with."""
        ...

    def seed(self) -> ArmState:
        """Start everything from the measured state, and return it."""
        ...

    def stride(
        self,
        intent: Intent,
        grip: GripCommand,
        *,
        n_ticks: int,
        wait_at_m: Vec3 | None = None,
        around: Surroundings | None = None,
    ) -> Stride:
        """Carry out an intent for so many ticks."""
        ...
