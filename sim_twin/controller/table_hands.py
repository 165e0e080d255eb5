"""What a person does and sees at the twin's table without the arm: presses, puts things in boxes, looks."""

import numpy as np

from robot.bus import CellTruth
from sim_twin.names import on_table
from sim_twin.plant import TwinWorld
from sim_twin.scene import leaf_names

__all__ = ["TableHands"]

PRESS_N = 40.0
"""A finger's force: it bottoms the cap out."""
ABOVE_FLOOR_M = 0.01


class TableHands:
    """Acts through the physics: a force on a button's cap, a thing put down in a box. Nothing touches an input.

    Args:
        world: Whose table it is.
    """

    def __init__(self, world: TwinWorld) -> None:
        self._world = world
        self._scenario = world.scenario
        self._taken: dict[str, np.ndarray] = {}

    def act(self, name: str, *, is_on: bool) -> None:
        """Press a button or let go of it; put a thing into a box with a sensor or take it out to where it was.

        Raises:
            ValueError: there is no such button or box.
        """
        buttons = [b.name for b in self._scenario.buttons]
        boxes = [b.name for b in self._scenario.boxes if b.presence_input is not None]
        if name in buttons:
            joint = self._world.model.joint(on_table(name, "travel"))
            self._world.data.qfrc_applied[int(joint.dofadr[0])] = PRESS_N if is_on else 0.0
        elif name in boxes:
            self._put_in(name) if is_on else self._take_out(name)
        else:
            raise ValueError(f"expected one of {', '.join((*buttons, *boxes))}, got {name!r}")

    def let_go(self) -> None:
        """Take the hands off everything (a reset has put things elsewhere)."""
        self._taken.clear()
        for button in self._scenario.buttons:
            joint = self._world.model.joint(on_table(button.name, "travel"))
            self._world.data.qfrc_applied[int(joint.dofadr[0])] = 0.0

    def look(self) -> CellTruth:
        """Return which lamps are lit and how far the lids are open."""
        world = self._world
        lids = {}
        for box in self._scenario.boxes:
            if box.lid is not None:
                angles = [float(world.data.qpos[int(world.model.joint(n).qposadr[0])]) for n in leaf_names(box)]
                lids[box.name] = min(angles) / box.lid.open_angle_rad
        lamps = {b.name: bool(world.digital_out >> b.lamp_output & 1) for b in self._scenario.buttons}
        return CellTruth(lamps=lamps, lids=lids)

    def _put_in(self, box_name: str) -> None:
        if box_name in self._taken:
            return
        world = self._world
        thing = next((c for c in self._scenario.cylinders if c.receptacle == box_name), self._scenario.cylinders[0])
        q = self._pose_of(thing.name)
        self._taken[box_name] = q.copy()
        place = world.data.xpos[world.model.body(on_table(box_name)).id]
        q[:] = (place[0], place[1], place[2] + thing.height_m / 2 + ABOVE_FLOOR_M, 1.0, 0.0, 0.0, 0.0)
        self._still(thing.name)

    def _take_out(self, box_name: str) -> None:
        before = self._taken.pop(box_name, None)
        if before is None:
            return
        thing = next((c for c in self._scenario.cylinders if c.receptacle == box_name), self._scenario.cylinders[0])
        self._pose_of(thing.name)[:] = before
        self._still(thing.name)

    def _pose_of(self, name: str) -> np.ndarray:
        address = int(self._world.model.joint(on_table(name)).qposadr[0])
        return self._world.data.qpos[address : address + 7]

    def _still(self, name: str) -> None:
        address = int(self._world.model.joint(on_table(name)).dofadr[0])
        self._world.data.qvel[address : address + 6] = 0.0
