"""One lamp over pictures: what it shows, since when that was last seen. State."""

from perception.detection.lamps import Debounce
from perception.detection.seen import LampSeen, LampState

__all__ = ["LampTrack"]

N_ALIKE = 2


class LampTrack:
    """A debounced lamp with the time of the newest picture that bears it out.

    The first picture since the beginning that tells is believed at once: nothing speaks against it.

    Attributes:
        stamp_ns: Of the newest picture that shows what is believed; None where none does.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._debounce = Debounce(N_ALIKE)
        self.stamp_ns: int | None = None

    @property
    def is_lit(self) -> bool:
        """What is believed; not lit where nothing is known."""
        return self._debounce.state is LampState.ON

    def note(self, seen: LampSeen, stamp_ns: int) -> None:
        """Take in what one picture shows of the lamp."""
        if seen.state is LampState.UNKNOWN:
            return
        is_first = self._debounce.state is LampState.UNKNOWN
        believed = self._debounce.begin(seen.state) if is_first else self._debounce.note(seen.state)
        if believed is seen.state:
            self.stamp_ns = stamp_ns
