"""`autotelic perception show`: what a rig's camera sees, and what is made of it, as pictures."""

from collections.abc import Iterator

from config.resolved import Resolved
from perception.annotating import annotated
from perception.detection.arm_outline import arm_outlines
from perception.from_camera import CameraPerception
from robot.errors import RobotConfigError
from robot.frames import Frame, Picture, picture_of
from robot.hal.protocols import Camera
from robot.messages import Percept
from robot.rigs import build_plant

__all__ = ["shown_tables"]


class _Overlooked:
    """A camera whose frames somebody else may see too: keeps the newest one."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self.spec = camera.spec
        self.newest: Frame | None = None

    def connect(self) -> None:
        self._camera.connect()

    def read(self, now_ns: int) -> Frame | None:
        frame = self._camera.read(now_ns)
        self.newest = frame or self.newest
        return frame

    def close(self) -> None:
        self._camera.close()


def shown_tables(resolved: Resolved, *, seed: int, n_tables: int, n_pictures: int) -> Iterator[tuple[Picture, Percept]]:
    """Give an annotated picture and its percept of each of some tables that a rig's plant lays out. Nothing moves.

    Args:
        resolved: the rig, its arm and scenario; the perception must be by camera.
        seed: of the tables.
        n_tables: how many.
        n_pictures: so many pictures are looked at of each; the last one is drawn.

    Raises:
        RobotConfigError: the rig's plant has no camera, or the camera is not the one that was calibrated.
    """
    rig, arm, scenario = resolved.rig, resolved.arm, resolved.scenario
    if rig.bus is not None:
        raise RobotConfigError(f"rig {rig.name}: expected a rig in lock-step; over the bus nothing is shown yet")
    perception = CameraPerception(scenario=scenario, arm=arm, rig=rig)
    plant = build_plant(rig=rig, arm=arm, scenario=scenario, cell=resolved.cell)
    cameras = {name: _Overlooked(camera) for name, camera in plant.cameras.items()}
    perception.watch(cameras)
    plant.arm.connect()
    perception.connect()
    try:
        for epoch in range(n_tables):
            opened = sum(1 << b.lid.output for b in scenario.boxes if b.lid is not None) if epoch % 2 else 0
            plant.resetter.reset(seed=seed, epoch=epoch, digital_out=opened)
            perception.forget()
            percept = perception.perceive(plant.arm.read(), None)
            for _ in range(n_pictures - 1):
                for _ in range(round(arm.motion.step_s / rig.tick_s)):
                    plant.arm.clock.wait_tick()
                percept = perception.perceive(plant.arm.read(), None)
            frame = next(iter(cameras.values())).newest
            assert frame is not None, "the resetter waited for one"
            state = plant.arm.read()
            outlines = arm_outlines(arm, state.q_rad, state.grip.opening_m, perception.eye)
            truth = None if plant.truth is None else plant.truth.read()
            yield annotated(picture_of(frame), perception.eye, scenario, percept, arm=outlines, truth=truth), percept
    finally:
        perception.close()
        plant.arm.close()
