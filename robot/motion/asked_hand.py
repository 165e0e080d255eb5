"""A hand that does what it was asked and nothing by itself: a person's. State of one hand between resets."""

from config.arm import ArmConfig
from robot.messages import Grip, GripCommand, Percept, Vec3

__all__ = ["AskedHand"]


class AskedHand:
    """Decides once a step what the hand is asked, as robot.motion.HandReflexes does, without any reflex.

    Until somebody asks for something the fingers stay as they are; what they hold they go on holding.

    Attributes:
        wait_at_m: None: the arm never waits for the fingers.
        lost_object: What was held is held no longer although nobody let go.
    """

    def __init__(self, arm: ArmConfig) -> None:
        tool = arm.tool
        self._stroke_m, self._slow_m_s = tool.stroke_m, tool.speed_m_s[0]
        self._least_n, self._grip_n = tool.force_n[0], tool.grip_force_n
        speed = tool.speed_m_s[1]
        self._open = GripCommand(opening_m=tool.stroke_m, force_n=self._least_n, speed_m_s=speed)
        self._shut = GripCommand(opening_m=0.0, force_n=self._grip_n, speed_m_s=speed)
        self.reset(None)

    def reset(self, percept: Percept | None) -> None:
        """Begin with the fingers as they are."""
        self.wait_at_m: Vec3 | None = None
        self.lost_object = self._had_object = False
        self._command = self._open
        if percept is not None:
            self._had_object = percept.grip.has_object
            opening_m = min(max(percept.grip.opening_m, 0.0), self._stroke_m)
            still = GripCommand(opening_m=opening_m, force_n=self._grip_n, speed_m_s=self._slow_m_s)
            self._command = self._shut if self._had_object else still

    def decide(self, percept: Percept, asked: Grip | None) -> GripCommand:
        """Return what the hand is asked for the coming step."""
        has_object = percept.grip.has_object
        self.lost_object = self._had_object and not has_object and self._command is self._shut
        self._had_object = has_object
        if asked is not None:
            self._command = self._open if asked is Grip.OPEN else self._shut
        return self._command
