"""The film itself: scene after scene, picture after picture. The edge to what draws, and to what writes."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np

from config.resolved import Resolved
from learning.figure_style import styles
from learning.film.lettering import Picture
from learning.film.relive import Reliving, Shot
from learning.film.sheet import VIEW_PX, Chart, GoalLine, card, sheet
from learning.film.story import HELD_S, Card, Examined, Lived, Scene, allotted, name_of, story_of
from learning.report import Run, load_run
from learning.run_folder import RunFolder
from robot.recording.film import DRAWER, Draws
from robot.recording.images import opencv
from robot.recording.video import write_video
from robot.rigs import load

__all__ = ["RATE_HZ", "film_run"]

RATE_HZ = 20.0
STEP_S = 0.05
GROWING_S = 2.0
"""In which the chart comes up to where a scene is."""

Tell = Callable[[str], object]


def film_run(folder: RunFolder, out: Path, *, rate_hz: float = RATE_HZ, tell: Tell = lambda _: None) -> float:
    """Film a run and return how long the film is, seconds.

    Args:
        folder: of the run; it is only read.
        out: the video.
        rate_hz: pictures a second.
        tell: hears how far it is.

    Raises:
        LearningError: the run cannot be lived again, or comes to something else.
        UnfitError: nothing can be drawn here, or there is no place for the video.
    """
    run = load_run(folder)
    opener: Callable[[Resolved], AbstractContextManager[Draws]] = load(DRAWER)
    reliving = Reliving(folder, tell=tell)
    try:
        with opener(folder.config()) as draw:
            pictures = _Filming(run, reliving, draw, rate_hz=rate_hz, tell=tell).pictures()
            return write_video(out, pictures, rate_hz=rate_hz) / rate_hz
    finally:
        reliving.close()


class _Filming:
    def __init__(self, run: Run, reliving: Reliving, draw: Draws, *, rate_hz: float, tell: Tell) -> None:
        self._run, self._reliving, self._draw = run, reliving, draw
        self._rate_hz, self._tell = rate_hz, tell
        self._chart = Chart(run)
        self._styles = styles(run.manifest.goals)
        self._shown_until = 0.0

    def pictures(self) -> Iterator[Picture]:
        """Yield every picture of the film."""
        story = story_of(self._run)
        shots = [self._shots(scene) for scene in story]
        seconds = allotted(story, [len(taken) * STEP_S for taken in shots])
        for i, (scene, taken, lasting) in enumerate(zip(story, shots, seconds, strict=True)):
            self._tell(f"drawing scene {i + 1} of {len(story)}: {scene.title}")
            yield from self._card(scene, lasting) if isinstance(scene, Card) else self._played(scene, taken, lasting)

    def _card(self, scene: Card, seconds: float) -> Iterator[Picture]:
        for until in self._growing(scene.at, round(seconds * self._rate_hz)):
            yield card(title=scene.title, says=scene.says, chart=self._chart.until(until))

    def _played(self, scene: Lived | Examined, shots: Sequence[Shot], seconds: float) -> Iterator[Picture]:
        """Yield a scene, faster than it was where it would take too long, its end held."""
        n_held = round(HELD_S * self._rate_hz)
        picked = _picked(shots, max(2, round(seconds * self._rate_hz) - n_held))
        speed = len(shots) * STEP_S * self._rate_hz / len(picked)
        played = [*picked, *[picked[-1]] * n_held]
        at = scene.rules_epoch if isinstance(scene, Examined) else scene.at
        before: tuple[int, Picture] | None = None
        for i, until in zip(played, self._growing(at, len(played)), strict=True):
            if before is None or before[0] != i:
                before = (i, self._view(shots[i]))
            yield self._sheet(scene, shots[i], before[1], speed, until)

    def _shots(self, scene: Scene) -> list[Shot]:
        if isinstance(scene, Card):
            return []
        self._tell(f"living again: {scene.title}")
        if isinstance(scene, Examined):
            return self._reliving.test(scene.at, rules_epoch=scene.rules_epoch, goal=scene.goal)
        return [s for epoch in range(scene.at, scene.at + scene.n_epochs) for s in self._reliving.live(epoch)]

    def _growing(self, at: float, n: int) -> Iterator[float]:
        """Yield, so many times, up to which epoch the chart is shown: it comes up to a scene's own in a while."""
        begin, n_growing = self._shown_until, min(n, round(GROWING_S * self._rate_hz))
        self._shown_until = max(begin, at)
        for i in range(n):
            yield begin + (self._shown_until - begin) * min(1.0, (i + 1) / max(1, n_growing))

    def _view(self, shot: Shot) -> Picture:
        cv2 = opencv()
        return cv2.resize(self._draw(shot.state, shot.percept), VIEW_PX, interpolation=cv2.INTER_AREA)

    def _sheet(self, scene: Scene, shot: Shot, view: Picture, speed: float, until: float) -> Picture:
        where = f"epoch {shot.epoch}" if isinstance(scene, Lived) else "test"
        fast = f", {speed:.0f} times as fast" if speed >= 1.5 else ""
        goals = [self._line(shot, i) for i in range(len(self._styles))]
        return sheet(
            view, title=scene.title, says=scene.says, now=shot.ended or f"{where}, trial {max(1, shot.trial)}{fast}",
            goals=goals, chart=self._chart.until(until),
        )  # fmt: skip

    def _line(self, shot: Shot, goal: int) -> GoalLine:
        is_on = shot.holds[goal]
        says = "achieved" if is_on and goal == shot.goal else "on" if is_on else ""
        if not is_on and not shot.ended:
            says = "wanted" if goal == shot.goal else ""
            if goal == shot.subgoal:
                says = "wanted, tried" if goal == shot.goal else "tried now"
        return GoalLine(
            name=name_of(goal, self._run.manifest), colour=self._styles[goal].colour, says=says, is_on=is_on
        )


def _picked(shots: Sequence[Shot], n: int) -> list[int]:
    """Return so many shots' places, evenly, the last one among them."""
    return [int(i) for i in np.linspace(0, len(shots) - 1, n).round()]
