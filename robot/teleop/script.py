"""A device that is a file: timed asks, read step by step. The same file drives the same way every time."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from config.decode import decode
from config.sources import read_path
from config.values import Section, Share
from config.yaml_text import parse_yaml
from robot.errors import RobotConfigError
from robot.messages import Grip
from robot.teleop.device import DriverInput, EpisodeKey, Frame

__all__ = ["Script", "ScriptStep", "ScriptedDevice", "load_script"]

AxisShare = Annotated[float, Meta(ge=-1.0, le=1.0)]
Direction = tuple[AxisShare, AxisShare, AxisShare]


class ScriptStep(Section, frozen=True, kw_only=True):
    """What is asked for a while; what is left out stays as it was for grip, and is at rest for the rest."""

    for_s: Annotated[float, Meta(gt=0.0, le=3600.0)]
    linear: Direction = (0.0, 0.0, 0.0)
    angular: Direction = (0.0, 0.0, 0.0)
    is_held: bool = True
    is_clutched: bool = False
    is_silent: bool = False
    """The device says nothing meanwhile: what it said last grows old."""
    grip: Grip | None = None
    speed_share: Share = 1.0
    frame: Frame = Frame.BASE
    episode: EpisodeKey | None = None
    """Said of the episode in hand as the step begins."""


class Script(Section, frozen=True, kw_only=True):
    """A drive, from its start to its end."""

    steps: Annotated[tuple[ScriptStep, ...], Meta(min_length=1)]


def load_script(path: Path) -> Script:
    """Return a script of a YAML or JSON file.

    Raises:
        ConfigError: no such file, or not a script.
    """
    source = read_path(path)
    return decode(parse_yaml(source.text, source.file), Script, source.file)


class ScriptedDevice:
    """Implements Device with a script: each read is one step further, whatever the wall's clock says.

    Args:
        detail: path of the script.
        now_ns: the driver's time, for stamps alone.
        step_s: how long a step is.
    """

    name = "script"
    keys = (("script", "drives by itself; Ctrl-C ends it"),)

    def __init__(self, *, detail: str, now_ns: Callable[[], int], step_s: float) -> None:
        if not detail:
            raise RobotConfigError("--device script: expected script:FILE, came no file")
        self._now_ns = now_ns
        self._asked = _spread(load_script(Path(detail)), step_s)
        self._n_read = 0
        self._said = DriverInput(stamp_ns=now_ns())

    def connect(self) -> None:
        """There is nothing to acquire; the script goes on where it was."""

    def read(self) -> DriverInput:
        """Return what the script asks in the next step; after its end, that it is over."""
        if self._n_read >= len(self._asked):
            return DriverInput(stamp_ns=self._now_ns(), is_over=True, grip=self._said.grip)
        step = self._asked[self._n_read]
        is_first = not self._n_read or self._asked[self._n_read - 1] is not step
        self._n_read += 1
        if not step.is_silent:
            self._said = DriverInput(
                stamp_ns=self._now_ns(),
                linear=step.linear,
                angular=step.angular,
                is_held=step.is_held,
                is_clutched=step.is_clutched,
                grip=step.grip or self._said.grip,
                speed_share=step.speed_share,
                frame=step.frame,
            )
        return msgspec.structs.replace(self._said, episode=step.episode if is_first else None)

    def close(self) -> None:
        """Nothing is held."""


def _spread(script: Script, step_s: float) -> list[ScriptStep]:
    """Return what is asked in each step of the drive, by the middle of the step."""
    asked: list[ScriptStep] = []
    end_s = 0.0
    for step in script.steps:
        end_s += step.for_s
        while (len(asked) + 0.5) * step_s < end_s:
            asked.append(step)
    return asked
