"""A reset that a person does: the arm is let go of, a picture says what belongs where, what is perceived is checked."""

import math
from pathlib import Path
from typing import Protocol

import numpy as np

from config.scenario import Scenario
from robot.errors import WireError
from robot.hal.protocols import SceneTruth
from robot.layout import Layout, draw_layout
from robot.messages import SceneState
from robot.person import Person

__all__ = ["PersonLook", "PersonResetter", "misplaced", "unseen_under_lids"]

TOLERANCE_M = 0.01
HIGH_M = 0.02
"""A cylinder in a box stands on its floor."""
UPRIGHT = math.cos(math.radians(15.0))
MM = 1e3


class _Stops(Protocol):
    """What a reset needs of the loop."""

    def stop(self) -> None:
        """Stop the arm and give up command."""
        ...

    def await_rest(self) -> None:
        """Wait until an arm that was lost must be at rest."""
        ...

    @property
    def why_lost(self) -> str | None:
        """Why command was lost and not given up, None where it was given up."""
        ...


class PersonResetter:
    """Implements robot.hal.protocols.Resetter with a person's hands.

    Args:
        scenario: What is on the table.
        loop: What holds the arm; it gives up command before anybody reaches in.
        scene: Where things are perceived to be.
        person: Who does it.
        pictures: Folder for the pictures.
    """

    def __init__(self, *, scenario: Scenario, loop: _Stops, scene: SceneTruth, person: Person, pictures: Path) -> None:
        self._scenario, self._loop, self._scene = scenario, loop, scene
        self._person, self._pictures = person, pictures

    def layout_of(self, *, seed: int, epoch: int) -> Layout:
        """Return the table that a reset draws."""
        return draw_layout(self._scenario, np.random.default_rng([seed, epoch]))

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Let the person lay the table out until what is perceived is as drawn.

        Raises:
            SafetyError: nobody is there any more.
        """
        del digital_out  # lamps and lids follow the cell's program as soon as the arm is taken again
        self._loop.stop()
        self._loop.await_rest()
        layout = self.layout_of(seed=seed, epoch=epoch)
        path = self._pictures / f"epoch-{epoch:05d}-seed-{seed}.png"
        from robot.layout_picture import draw_picture  # brings matplotlib, which only a person needs

        draw_picture(self._scenario, layout, f"epoch {epoch}: where things belong (mm, base frame)", path)
        request = f"{self._how_it_is()}; lay the table out for epoch {epoch}, seed {seed}, as in {path}"
        is_laid_out = False
        while not is_laid_out:
            self._person.await_key(request)
            request = "put right what is not in place"
            unseen = self._unseen_where_in_place(layout)
            if unseen is not None:
                on_word = "".join(f"; {name} is taken on your word to be in {box}" for name, box in unseen.items())
                self._person.confirm(
                    f"everything that can be seen is in place{on_word}; take your hands off the table, the arm moves "
                    "next"
                )
                is_laid_out = self._unseen_where_in_place(layout) is not None

    def _how_it_is(self) -> str:
        """Return in words whether the arm was seen to be let go of."""
        why = self._loop.why_lost
        if why is None:
            return "the arm is disarmed"
        return f"NOT CONFIRMED that nothing runs on the arm ({why}): look at its pendant that no program does"

    def _unseen_where_in_place(self, layout: Layout) -> dict[str, str] | None:
        """Look, and say what is not in place: then None, else what nobody sees under lids, and in which box."""
        try:
            scene = self._scene.read()
            off = misplaced(layout, scene, self._scenario)
        except WireError as error:  # a table that nobody sees is none
            scene, off = None, [f"nothing is perceived: {error}"]
        for line in off:
            self._person.tell(f"not in place: {line}")
        return unseen_under_lids(scene, self._scenario) if scene is not None and not off else None


class PersonLook:
    """Implements robot.hal.protocols.Resetter where a person drives: nothing is laid out, somebody looks.

    Args:
        loop: What holds the arm; it gives up command before anybody reaches in.
        person: Who looks.
    """

    def __init__(self, *, loop: _Stops, person: Person) -> None:
        self._loop, self._person = loop, person

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Let the person see to whatever is wrong. Raises SafetyError where nobody is there any more."""
        del seed, epoch, digital_out
        self._loop.stop()
        self._loop.await_rest()
        self._person.confirm("the arm is disarmed: see to what is wrong at the table, take your hands off it")


def unseen_under_lids(scene: SceneState, scenario: Scenario) -> dict[str, str]:
    """Return what belongs in a box with a lid and is not perceived, by the box's name: nobody can look inside."""
    lidded = {box.name for box in scenario.boxes if box.lid is not None}
    seen = {thing.name for thing in scene.objects}
    return {c.name: c.inside for c in scenario.cylinders if c.inside in lidded and c.name not in seen}


def misplaced(layout: Layout, scene: SceneState, scenario: Scenario) -> list[str]:
    """Return in words what is more than 10 mm from where it was drawn, lies, is held up, or is not perceived.

    What is not perceived because a lid hides it is not among these.
    """
    places = {thing.name: thing.position_m for thing in scene.objects}
    hidden = unseen_under_lids(scene, scenario)
    wanted = layout.fixtures_m | {name: standing.position_m for name, standing in layout.cylinders.items()}
    off = []
    for name, (x, y) in wanted.items():
        if name not in places:
            if name not in hidden:
                off.append(f"{name}: not perceived: is something between it and the camera?")
            continue
        away_m = math.dist((x, y), places[name][:2])
        if not away_m <= TOLERANCE_M:
            is_x, is_y, _ = places[name]
            off.append(
                f"{name}: {away_m * MM:.0f} mm off, belongs at {x * MM:.0f}, {y * MM:.0f}, is at {is_x * MM:.0f}, "
                f"{is_y * MM:.0f}"
            )
    return [*off, *_fallen(scene, scenario)]


def _fallen(scene: SceneState, scenario: Scenario) -> list[str]:
    """Return in words which loose cylinders do not stand at the height at which they would."""
    heights_m = {c.name: scenario.table.height_m + c.height_m / 2 for c in scenario.cylinders}
    off = []
    for thing in scene.objects:
        expected_m = heights_m.get(thing.name)
        if expected_m is None:
            continue
        up = 1.0 - 2.0 * (thing.quat[1] ** 2 + thing.quat[2] ** 2)  # of its axis, along the vertical
        high_m = thing.position_m[2] - expected_m
        if abs(up) < UPRIGHT:
            off.append(f"{thing.name}: must stand, it lies or leans")
        elif abs(high_m) > HIGH_M:
            off.append(f"{thing.name}: {high_m * MM:+.0f} mm off in height: what is under it?")
    return off
