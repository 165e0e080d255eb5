"""Everything that a scenario names, in one picture of a calibrated camera."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import msgspec
import numpy as np

from config.scenario import Scenario
from perception.calibration.camera_file import CameraFile
from perception.calibration.lens import Array
from perception.detection.boxes import BoxFinder
from perception.detection.buttons import ButtonFinder, ButtonFound
from perception.detection.colour_file import ColourFile
from perception.detection.cylinders import CylinderFinder
from perception.detection.eye import Eye
from perception.detection.glance import Field, glance
from perception.detection.hiding import Hiders
from perception.detection.lamps import lamp_score, lamp_state
from perception.detection.palette import Palette
from perception.detection.seen import Detections, LampSeen, LampState, LidSeen, LidState, Stance, ThingSeen
from perception.errors import PerceptionConfigError
from robot.frames import Frame, picture_of
from robot.messages import Vec3

__all__ = ["Detector"]


class Detector:
    """Looks at one picture at a time and remembers nothing of the one before.

    Args:
        camera: its lens and place.
        scenario: sizes, heights and where things may stand.
        colours: what was learnt from the guided sample.

    Raises:
        PerceptionConfigError: the camera has no place, or a thing no colour.
    """

    def __init__(self, *, camera: CameraFile, scenario: Scenario, colours: ColourFile) -> None:
        self._eye, self._scenario, self._colours = Eye(camera), scenario, colours
        lacking = {t.name for t in (*scenario.buttons, *scenario.cylinders)} - {m.name for m in colours.models}
        if lacking:
            raise PerceptionConfigError(f"expected a colour learnt for {', '.join(sorted(lacking))}: name regions")
        self._palette = Palette(colours, scenario)
        self._field = Field.of(self._eye, scenario)
        table_m, bit = scenario.table.height_m, self._palette.bit
        self._boxes = [BoxFinder(b, table_m, self._eye) for b in scenario.boxes]
        self._buttons = [ButtonFinder(b, table_m, self._eye, bit(b.name)) for b in scenario.buttons]
        self._cylinders = [CylinderFinder(c, table_m, self._eye, bit(c.name)) for c in scenario.cylinders]
        self._lamp_by_name = {lamp.name: lamp for lamp in colours.lamps}

    def look(
        self, frame: Frame, before: Sequence[Array] = (), near: Mapping[str, Vec3] = MappingProxyType({})
    ) -> Detections:
        """Return what a picture shows.

        Args:
            frame: the picture.
            before: convex polygons of pixels that are known to be the arm's.  each (n, 2)
            near: where things were seen before; a loose one of these is looked for there alone.

        Raises:
            PerceptionConfigError: a picture of another size than the camera's file says.
        """
        lens = self._eye.lens
        if (frame.width_px, frame.height_px) != (lens.width_px, lens.height_px):
            raise PerceptionConfigError(
                f"camera {frame.camera}: expected {lens.width_px} × {lens.height_px} pixels as calibrated, came "
                f"{frame.width_px} × {frame.height_px}"
            )
        seen = glance(picture_of(frame), self._field, self._palette, np.array(self._colours.table_rgb))
        if seen is None:
            return self._nothing(frame.stamp_ns)
        boxes = [finder.find(seen, near.get(finder.name)) for finder in self._boxes]
        hiders = Hiders(self._eye, [solid for box in boxes for solid in box.solids], before)
        buttons = [finder.find(seen, hiders) for finder in self._buttons]
        cylinders = [finder.find(seen, hiders, near.get(finder.name)) for finder in self._cylinders]
        if not before or any(box.lid is not None and box.lid.state is LidState.UNKNOWN for box in boxes):
            # The arm, or leaves on their way, may stand before anything: nothing is known to be gone.
            cylinders = [msgspec.structs.replace(thing, is_gone=False) for thing in cylinders]
        return Detections(
            stamp_ns=frame.stamp_ns,
            things=(*(b.thing for b in buttons), *(b.thing for b in boxes), *cylinders),
            lamps=tuple(self._lamp(found) for found in buttons),
            lids=tuple(box.lid for box in boxes if box.lid is not None),
        )

    def dome_readings(self, frame: Frame) -> dict[str, Array]:
        """Return how the domes look that can be read, by button: what lamps are learnt from."""
        seen = glance(picture_of(frame), self._field, self._palette, np.array(self._colours.table_rgb))
        if seen is None:
            return {}
        solids = [solid for finder in self._boxes for solid in finder.find(seen).solids]
        found = [finder.find(seen, Hiders(self._eye, solids)) for finder in self._buttons]
        return {b.thing.name: b.reading for b in found if b.reading is not None}

    def _lamp(self, found: ButtonFound) -> LampSeen:
        model = self._lamp_by_name.get(found.thing.name)
        score = None if model is None or found.reading is None else lamp_score(model, found.reading)
        return LampSeen(name=found.thing.name, state=lamp_state(score), score=score)

    def _nothing(self, stamp_ns: int) -> Detections:
        scenario = self._scenario
        things = (*scenario.buttons, *scenario.boxes, *scenario.cylinders)
        return Detections(
            stamp_ns=stamp_ns, is_lit=False,
            things=tuple(
                ThingSeen(
                    name=t.name, position_m=None, stance=Stance.UNKNOWN, axis_rad=None, confidence=0.0, visible=0.0
                )
                for t in things
            ),
            lamps=tuple(LampSeen(name=b.name, state=LampState.UNKNOWN, score=None) for b in scenario.buttons),
            lids=tuple(
                LidSeen(name=b.name, state=LidState.UNKNOWN, confidence=0.0) for b in scenario.boxes if b.lid
            ),
        )  # fmt: skip
