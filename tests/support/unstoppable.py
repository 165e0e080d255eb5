"""A fake plant whose arm nobody sees to stop: what is told of it, and when."""

from robot.hal.fake import FakePlant

__all__ = ["PLANT", "UnstoppablePlant"]

PLANT = "tests.support.unstoppable:UnstoppablePlant"


class UnstoppablePlant(FakePlant):
    """Its arm never confirms a stop."""

    def __init__(self, **parts):
        super().__init__(**parts)
        hold = self.arm.stop
        self.arm.stop = lambda: hold() and False
