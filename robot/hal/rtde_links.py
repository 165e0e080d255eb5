"""The links of one arm's clients: whether they stand, and what ends this process where they do not."""

from collections.abc import Callable

from robot.errors import StaleStateError
from robot.hal.link_guard import LinkGuard
from robot.hal.link_watch import LinkWatch
from robot.hal.rtde_probe import RTDE_PORT

__all__ = ["RtdeLinks"]


class RtdeLinks:
    """Connections to a controller's RTDE port. Lost once is lost for good.

    Args:
        address: host or IP address of the controller.

    Attributes:
        is_lost: A link was cut, or the controller fell silent.
        when_lost: Called from a thread once that happens while nobody ticks; ends this process. None where it may not
            end: then the client goes on by itself.
        when_uploading: Called before a client uploads its program; until then nothing on the arm is ours.
    """

    def __init__(self, address: str) -> None:
        self._watch = LinkWatch(address, RTDE_PORT)
        self._guard: LinkGuard | None = None
        self.is_lost = False
        self.when_lost: Callable[[], object] | None = None
        self.when_uploading: Callable[[], object] = lambda: None

    @property
    def is_lost_now(self) -> bool:
        """Whether they are lost, as the operating system knows at once."""
        self.is_lost |= self._watch.is_cut()
        return self.is_lost

    def require(self) -> None:
        """Raise before the client finds out and reconnects.

        Raises:
            StaleStateError: the controller hung up, now or before.
        """
        if self.is_lost_now:
            raise StaleStateError("arm: expected its link to stand, it was cut; whoever wants to move begins anew")

    def look(self) -> None:
        """Watch what one more client has connected.

        Raises:
            StaleStateError: it is connected no more.
        """
        n_watched = self._watch.n_watched
        self.is_lost |= self._watch.look() <= n_watched
        self.require()

    def begin_guard(self, timestamp_s: Callable[[], float]) -> None:
        """Have this process ended, where it may, once they are lost; until `forget`.

        Args:
            timestamp_s: the controller's own time as last heard.
        """
        if self.when_lost is not None:
            self._guard = LinkGuard(self._watch, timestamp_s=timestamp_s, when_lost=self.when_lost)
            self._guard.begin()

    def pause(self) -> None:
        """Watch nothing, before a client goes and its connection with it; `look` goes on."""
        self._watch.forget()

    def forget(self) -> None:
        """Watch nothing any more."""
        guard, self._guard = self._guard, None
        if guard is not None:
            guard.end()
        self._watch.forget()
