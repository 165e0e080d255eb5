"""Which commands came before, as far as the gate judges the next by them. Memory of three commands.

A command that gave way to a push, or went on while one lasted, may be followed by one that starts from rest where it
led, or by one that goes on. So after it there are two courses, and a command need keep to one of them; after two more
they are one again.
"""

from robot.envelope import Envelope
from robot.messages import Vec6
from robot.safety.checks import Refusal
from robot.safety.checks_profile import check_giving_way, check_joint_acceleration, check_joint_jerk

__all__ = ["JointCourse"]


class JointCourse:
    """The last command, and what may count as those before it."""

    def __init__(self, envelope: Envelope) -> None:
        self._envelope = envelope
        self.seed((0.0, 0.0, 0.0, 0.0, 0.0, 0.0))

    def seed(self, q_rad: Vec6) -> None:
        """Start at rest."""
        self.last_rad = q_rad
        self._befores: tuple[tuple[Vec6, Vec6], ...] = ((q_rad, q_rad),)
        """Pairs of the command before the last and the one before that, the true one first."""
        self._kept = self._befores

    @property
    def only(self) -> tuple[Vec6, Vec6] | None:
        """What came before the last command, if there is one course only; what is not checked keeps to it."""
        return self._befores[0] if len(self._befores) == 1 else None

    @property
    def is_at_rest(self) -> bool:
        """Whether holding still changes no speed and no acceleration."""
        q = self.last_rad
        return self._befores == ((q, q),)

    def check(self, q_rad: Vec6, pushed_rad: Vec6 | None) -> Refusal | None:
        """Refuse joints that gather or lose speed too hard by every course.

        Args:
            q_rad: the command.
            pushed_rad: where the arm is measured if something pushes it; None where nothing does.
        """
        first: Refusal | None = None
        kept: list[tuple[Vec6, Vec6]] = []
        for before_rad, earlier_rad in self._befores:
            refusal = self._check(q_rad, before_rad, earlier_rad)
            if refusal is None:
                kept.append((before_rad, earlier_rad))
            first = first or refusal
        self._kept = tuple(kept) or self._befores[:1]
        if kept:
            return None
        if pushed_rad is None:
            return first
        return check_giving_way(q_rad, self.last_rad, self._befores[0][0], pushed_rad, self._envelope)

    def _check(self, q_rad: Vec6, before_rad: Vec6, earlier_rad: Vec6) -> Refusal | None:
        last_rad, envelope = self.last_rad, self._envelope
        return check_joint_acceleration(q_rad, last_rad, before_rad, envelope) or check_joint_jerk(
            q_rad, last_rad, before_rad, earlier_rad, envelope
        )

    def add(self, q_rad: Vec6, *, is_pushed: bool) -> None:
        """Take note of a command that was checked last and sent."""
        pairs = [(self.last_rad, before) for before, _ in self._kept]
        if is_pushed:
            pairs.append((q_rad, q_rad))
        self._befores = (pairs[0],) if len(pairs) == 1 else tuple(dict.fromkeys(pairs))
        self._kept = self._befores
        self.last_rad = q_rad
