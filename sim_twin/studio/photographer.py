"""The twin as a photographer: boards to calibrate by, a guided sample, and pictures whose truth is known."""

from collections.abc import Iterator, Sequence
from types import MappingProxyType

import numpy as np

from config.resolved import Resolved
from robot.errors import RobotConfigError
from robot.frames import CameraSpec, Frame
from robot.kinematics import Kinematics
from robot.photographs import BoardPhotograph, NamedRegion, Photograph, PrintedBoard
from sim_twin.plant import TwinPlant
from sim_twin.render import NoGLError, light_lamps
from sim_twin.rendered_camera import Optics, RenderedCamera
from sim_twin.studio.boards import photograph_boards
from sim_twin.studio.conditions import Conditions, Lighting, drawn_conditions
from sim_twin.studio.naming import named_regions
from sim_twin.studio.staging import stage, stage_sample
from sim_twin.studio.viewing import RIG_VIEW, STUDIO_VIEW, View, nudged

__all__ = ["SAMPLE_SEED", "TwinPhotographer", "open_studio"]

SAMPLE_SEED = 900_001
VIEWS = MappingProxyType({view.name: view for view in (STUDIO_VIEW, RIG_VIEW)})
RATE_HZ = 30.0
PERIOD_NS = 40_000_000


def open_studio(resolved: Resolved, *, sharpness: float = 2.0, camera: str = "front") -> "TwinPhotographer":
    """Return a photographer of a scenario's table, with the camera of a name.

    Raises:
        RobotConfigError: there is no such camera, or nothing here can draw; the message says what to do.
    """
    if camera not in VIEWS:
        raise RobotConfigError(f"expected a camera of the twin ({', '.join(VIEWS)}), came {camera!r}")
    try:
        return TwinPhotographer(resolved, sharpness=sharpness, view=VIEWS[camera])
    except NoGLError as error:
        raise RobotConfigError(str(error)) from error


class TwinPhotographer:
    """One twin, one camera; every picture is drawn from a seed of its own."""

    def __init__(self, resolved: Resolved, *, sharpness: float, view: View) -> None:
        plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
        self._world, self._truth = plant.world, plant.truth
        self._kinematics, self._sharpness = Kinematics(resolved.arm), sharpness
        model = self._world.model
        view.set_quality(model)
        self._lighting, self._view, self._T_bc = Lighting(model), view, view.T_bc
        lens = view.lens
        self._spec = CameraSpec(
            name=view.name, serial="twin", width_px=lens.width_px, height_px=lens.height_px, rate_hz=RATE_HZ
        )
        self._camera = RenderedCamera(
            model=model, data=self._world.data, spec=self._spec, lens=lens, T_bc=self._T_bc,
            optics=Optics(sharpness=sharpness), rng=np.random.default_rng(0),
        )  # fmt: skip
        self._camera.connect()
        self._now_ns = 0

    def close(self) -> None:
        """Give up what draws."""
        self._camera.close()

    def boards(self, board: PrintedBoard) -> Iterator[BoardPhotograph]:
        """Give pictures of a printed board: for the lens, then lying on the table and touched."""
        return photograph_boards(board, self._spec, self._view)

    def sample(self) -> Sequence[tuple[Photograph, tuple[NamedRegion, ...]]]:
        """Give two pictures, lamps off and on, and what a person names in them."""
        taken = []
        for is_lit in (False, True):
            rng = np.random.default_rng([SAMPLE_SEED, int(is_lit)])
            stage_sample(self._world, self._kinematics, SAMPLE_SEED, is_lit=is_lit)
            photograph = self._taken("clean", rng)
            regions = named_regions(self._world.scenario, photograph.objects, self._view, is_lit=is_lit)
            taken.append((photograph, regions))
        return taken

    def photographs(self, seeds: Sequence[int], level: str) -> Iterator[Photograph]:
        """Give one picture a seed: the same seed is the same table under any level."""
        for seed in seeds:
            stage(self._world, self._kinematics, np.random.default_rng([seed, 0]))
            yield self._taken(level, np.random.default_rng([seed, 1]))

    def _taken(self, level: str, rng: np.random.Generator) -> Photograph:
        world = self._world
        conditions = drawn_conditions(level, world.model.nlight, self._sharpness, rng)
        frame = self._exposed(conditions, rng)
        scenario, out = world.scenario, world.digital_out
        assert self._truth is not None
        q_rad = world.data.qpos[:6].tolist()
        return Photograph(
            frame=frame, level=level, objects=self._truth.read().objects,
            lamps_on=tuple(b.name for b in scenario.buttons if out >> b.lamp_output & 1),
            lids_open=tuple(b.name for b in scenario.boxes if b.lid is not None and out >> b.lid.output & 1),
            q_rad=(q_rad[0], q_rad[1], q_rad[2], q_rad[3], q_rad[4], q_rad[5]), opening_m=world.arm.tool.stroke_m,
        )  # fmt: skip

    def _exposed(self, conditions: Conditions, rng: np.random.Generator) -> Frame:
        light_lamps(self._world)
        self._lighting.apply(conditions)
        T_bc = nudged(self._T_bc, conditions.turn_rad, conditions.shift_m)
        self._camera.adjust(optics=conditions.optics, T_bc=T_bc, rng=rng)
        frame = self._camera.read(self._now_ns)
        self._now_ns += PERIOD_NS
        assert frame is not None
        return frame
