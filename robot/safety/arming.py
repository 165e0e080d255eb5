"""From disarmed to engaged and back: who may arm, and what a latch takes to clear."""

from collections import deque
from typing import Protocol

import msgspec

from config.rig import PlantExpected
from robot.errors import NotEngagedError, SafetyError
from robot.messages import PlantIdentity, PlantKind, StationMode, StationState
from robot.safety.challenge import Answer, Challenges
from robot.safety.states import Event, next_mode

__all__ = ["Armable", "Arming", "Buttoned", "Grant", "Operator", "TooManyLatchesError"]


class Grant(msgspec.Struct, frozen=True, kw_only=True):
    """What a station is armed for. It ends with any of the three."""

    source: str
    profile: str
    lease: int

    def __str__(self) -> str:
        return f"{self.source} under lease {self.lease}, profile {self.profile}"


class Buttoned(Protocol):
    """What may have a button at its cell."""

    @property
    def has_button(self) -> bool:
        """Whether a button at the cell answers a challenge."""
        ...

    def pressed(self) -> Answer | None:
        """Look at that button; its press since the challenge is the answer. Raises SafetyError if none came in time."""
        ...


class Armable(Buttoned, Protocol):
    """What an operator may do with a station."""

    @property
    def identity(self) -> PlantIdentity:
        """Which world would be armed."""
        ...

    @property
    def state(self) -> StationState:
        """Mode and reason."""
        ...

    def challenge(self) -> str | None:
        """Let the cell show a code; return it where a console must show it, None where the cell itself does."""
        ...

    def arm(self, *, by: str, answer: Answer | None = None) -> None:
        """Go from disarmed to armed. A real arm asks for the answer to its challenge."""
        ...

    def engage(self) -> None:
        """Go from armed to engaged: targets are re-seeded from the measured state."""
        ...

    def reset_plant(self, *, seed: int, epoch: int) -> None:
        """Lay the table out while latched, so that the latch may be cleared."""
        ...

    def clear_latch(self, *, by: str, answer: Answer | None = None) -> None:
        """Go from latched to armed, after the plant's reset only. A real arm asks for the answer to its challenge."""
        ...


class Operator(Protocol):
    """A person at the station or, where no hardware is attached, who stands in for one."""

    def arm_once(self, station: Armable) -> None:
        """Arm and engage a disarmed station. Raises SafetyError for a plant this operator may not arm."""
        ...

    def rearm(self, station: Armable, *, seed: int, epoch: int) -> None:
        """After a latch: reset the plant, clear the latch, engage. Raises TooManyLatchesError when it is enough."""
        ...


class TooManyLatchesError(SafetyError):
    """The run has latched more often than it may: it fails."""


LOCAL_GRANT = Grant(source="local", profile="", lease=0)
"""What a station is armed for where nobody says more."""


class Arming:
    """The mode of one station, by the table of robot.safety.states. Pure state: touches no plant.

    Attributes:
        reasons: Why the station has latched since it was made, oldest first.
    """

    def __init__(
        self, *, expected: PlantExpected, max_latches: int, latch_window: int, challenges: Challenges | None = None
    ) -> None:
        """Begin disarmed.

        Args:
            expected: the plant that may be armed.
            max_latches: more of them within the window, and no latch is cleared any more.
            latch_window: resets of the plant.
            challenges: asks whoever is at the cell; None where no real arm may be armed.
        """
        self._expected = expected
        self._challenges = challenges
        self._max_latches, self._latch_window = max_latches, latch_window
        self._n_resets = 0
        self._latched_at = deque[int](maxlen=max_latches + 1)
        """Resets there had been at each of the newest latches."""
        self._mode = StationMode.DISARMED
        self._reason = ""
        self._grant: Grant | None = None
        self._is_plant_reset = False
        self.reasons: list[str] = []

    @property
    def state(self) -> StationState:
        """Mode; why it is latched or was disarmed; and whom and what it was armed for last."""
        grant = self._grant
        return StationState(
            mode=self._mode,
            reason=self._reason,
            source="" if grant is None else grant.source,
            profile="" if grant is None else grant.profile,
        )

    @property
    def n_latches(self) -> int:
        """How often the station has latched since it was made."""
        return len(self.reasons)

    @property
    def is_engaged(self) -> bool:
        """Whether motion may be asked for."""
        return self._mode is StationMode.ENGAGED

    def challenge(self, grant: Grant) -> str:
        """Return a fresh code for the cell to show: its answer arms for this grant, or clears the latch for it.

        Raises:
            SafetyError: nobody can be asked here, or there is nothing to arm or to clear.
        """
        if self._challenges is None:
            raise SafetyError("expected a station that can ask whoever is at its cell, this one cannot")
        if self._mode not in (StationMode.DISARMED, StationMode.LATCHED):
            raise SafetyError(f"to ask for arming the station must be disarmed or latched, it is {self._mode}")
        return self._challenges.ask(f"{self._mode}, {grant}")

    def arm(
        self, *, identity: PlantIdentity, by: str, grant: Grant = LOCAL_GRANT, answer: Answer | None = None
    ) -> None:
        """Go from disarmed to armed, for one source, profile and lease.

        Raises:
            SafetyError: the plant is not the one the rig names, nobody answers for it, the mode is another, or the
                arm is a real one and the answer is not what its cell shows.
        """
        mode = self._permitted(Event.ARM)
        self._check_answerable(identity, by, grant, answer)
        self._mode, self._reason, self._grant = mode, "", grant

    def require_armed(self) -> None:
        """Raise SafetyError unless it may be engaged."""
        self._permitted(Event.ENGAGE)

    def engage(self) -> None:
        """Go from armed to engaged."""
        self._mode = self._permitted(Event.ENGAGE)

    def disarm(self, why: str = "") -> None:
        """Go back to disarmed from anything but a latch, because what it was armed for is gone, or somebody lets go."""
        mode = self._permitted(Event.DISARM)
        if mode is not self._mode:
            self._mode, self._reason = mode, why

    def hold_to(self, grant: Grant | None) -> None:
        """Disarm unless what it was armed for is what there is now: the same source, profile and lease.

        Args:
            grant: what there is now; None where no lease is in force.
        """
        if self._mode in (StationMode.ARMED, StationMode.ENGAGED) and grant != self._grant:
            now = "no lease is in force" if grant is None else f"now there is {grant}"
            self.disarm(f"it was armed for {self._grant}; {now}")

    def stop(self, reason: str) -> None:
        """Take motion away because somebody says so: latches what was engaged, disarms what was armed."""
        if self._permitted(Event.STOP) is StationMode.LATCHED:
            self.latch(reason)
        else:
            self.disarm(reason)

    def latch(self, reason: str) -> None:
        """Take motion away until an operator clears it. The first reason stays."""
        if self._mode is StationMode.LATCHED:
            return
        self._mode = self._permitted(Event.LATCH)
        self._reason = reason
        self._is_plant_reset = False
        self._latched_at.append(self._n_resets)
        self.reasons.append(reason)

    def note_plant_reset(self) -> None:
        """The plant was reset: a latch may now be cleared by an operator. Clears nothing itself."""
        self._mode = self._permitted(Event.PLANT_RESET)
        self._is_plant_reset = True
        self._n_resets += 1

    def clear_latch(
        self, *, identity: PlantIdentity, by: str, grant: Grant = LOCAL_GRANT, answer: Answer | None = None
    ) -> None:
        """Go from latched to armed, for one source, profile and lease.

        Raises:
            TooManyLatchesError: it has latched too often lately.
            SafetyError: the plant was not reset since the latch, or is not the one the rig names; or the arm is a real
                one and the answer is not what its cell shows.
        """
        mode = self._permitted(Event.CLEAR_LATCH)
        n_lately = sum(self._n_resets - at < self._latch_window for at in self._latched_at)
        if n_lately > self._max_latches:
            raise TooManyLatchesError(
                f"expected at most {self._max_latches} latches in {self._latch_window} resets, came {n_lately}; "
                f"last: {self._reason}"
            )
        if not self._is_plant_reset:
            raise SafetyError(f"latched ({self._reason}): reset the plant before clearing the latch")
        self._check_answerable(identity, by, grant, answer)
        self._mode, self._reason, self._grant = mode, "", grant

    def require_engaged(self) -> None:
        """Raise NotEngagedError unless engaged."""
        if self._mode is not StationMode.ENGAGED:
            why = f" ({self._reason})" if self._reason else ""
            raise NotEngagedError(f"expected an engaged station, it is {self._mode}{why}; an operator must arm it")

    def _permitted(self, event: Event) -> StationMode:
        """Return the mode after an event. Raises SafetyError where the table refuses it."""
        mode = next_mode(self._mode, event)
        if mode is None:
            why = f" ({self._reason})" if self._reason else ""
            raise SafetyError(f"to {event.replace('_', ' ')} a station is refused while it is {self._mode}{why}")
        return mode

    def _check_answerable(self, identity: PlantIdentity, by: str, grant: Grant, answer: Answer | None) -> None:
        """Check that it is the plant that the rig names, that somebody answers for it and, for a real arm, is there."""
        self._check_identity(identity)
        kind = PlantKind(identity.kind)
        if not by:
            raise SafetyError(f"somebody must answer for arming a {kind.value} plant: name who")
        if kind is PlantKind.REAL and self._challenges is None:
            raise SafetyError("a real arm is armed by an answer to what its cell shows; this station cannot ask")
        if self._challenges is not None and (kind is PlantKind.REAL or answer is not None):
            self._challenges.redeem(answer, f"{self._mode}, {grant}")

    def _check_identity(self, identity: PlantIdentity) -> None:
        expected = self._expected
        want = (expected.kind, expected.model, expected.serial)
        came = (identity.kind.value, identity.model, identity.serial)
        if want != came:
            raise SafetyError(f"the rig names plant {'/'.join(want)}, found {'/'.join(came)}: check the rig's file")
