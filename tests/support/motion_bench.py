"""A motion without physics: what the set-point does in every slice, as if the joints were on it."""

from collections.abc import Callable, Iterable, Iterator

import msgspec
import numpy as np

from config.loader import resolve
from robot.layout import draw_layout
from sim_twin.controller.motion.core import Motion
from sim_twin.controller.motion.drive import TwinDrive
from sim_twin.controller.motion.kinematics import ArmKinematics, dh_rows
from sim_twin.controller.motion.limits import Breach
from sim_twin.controller.motion.motions import Motions
from sim_twin.controller.motion.poses import pose_from_matrix
from sim_twin.plant import TwinWorld

__all__ = ["HOME", "Trace", "idle", "make_bench", "make_drive", "over_the_table", "play"]

ARM = resolve().arm
HOME = np.array(ARM.home_rad)


class Perfect:
    """Joints that are where they are asked to be, and a tool that feels what it is told."""

    def __init__(self, motions: Motions) -> None:
        self._motions = motions
        self.wrench = np.zeros(6)

    @property
    def q_rad(self) -> np.ndarray:
        return self._motions.setpoint.q_target

    @property
    def qd_rad_s(self) -> np.ndarray:
        return self._motions.setpoint.qd_target


class Trace:
    """Runs motions slice by slice and keeps what the set-point did."""

    def __init__(self, q_rad: np.ndarray = HOME) -> None:
        self.motions = Motions(ARM, kinematics=ArmKinematics(dh_rows(ARM)), q_rad=np.array(q_rad), servo_lag_s=0.035)
        self.sensed = Perfect(self.motions)
        self.q, self.qd, self.tool = [self.motions.setpoint.q_target], [np.zeros(6)], [self.here()]

    def here(self) -> np.ndarray:
        return self.motions.core.tool_at(self.motions.setpoint.q_target)

    def shifted(self, dx: float = 0.0, dy: float = 0.0, dz: float = 0.0) -> np.ndarray:
        """Returns the pose (six numbers, base frame) that is so many metres beside the set-point's."""
        pose = pose_from_matrix(self.here())
        pose[:3] += (dx, dy, dz)
        return pose

    def end(self) -> None:
        self.motions.core.end_slice(self.sensed)
        self.q.append(self.motions.setpoint.q_target)
        self.qd.append(self.motions.setpoint.qd_target)
        self.tool.append(self.here())

    def run(self, *programs: Motion, at: Callable[[int], None] | None = None) -> int:
        """Run motions one after the other, as one thread of a program; return how many slices they took."""
        n = 0
        for _ in chain(programs):
            if at:
                at(n)
            self.end()
            n += 1
        return n

    def idle(self, n: int) -> None:
        for _ in range(n):
            self.end()

    def largest_step(self) -> np.ndarray:
        """Greatest change of speed from one slice to the next, per second.  () -> (6,)"""
        return np.abs(np.diff(np.array(self.qd), axis=0)).max(axis=0) / 0.002

    def path(self) -> np.ndarray:
        return np.array([T[:3, 3] for T in self.tool])


def chain(programs: Iterable[Motion]) -> Iterator[None]:
    for program in programs:
        yield from program


def make_bench(q_rad: np.ndarray = HOME) -> Trace:
    return Trace(q_rad)


def make_drive(q_rad: np.ndarray = HOME, *, is_engaged: bool = True) -> TwinDrive:
    resolved = resolve()
    rig = msgspec.structs.replace(resolved.rig, tick_s=0.002, physics_s=0.002)
    world = TwinWorld(resolved.arm, resolved.scenario, rig)
    layout = draw_layout(resolved.scenario, np.random.default_rng(0))
    world.put(layout, tuple(q_rad.tolist()), digital_out=0)
    drive = TwinDrive(world)
    if is_engaged:
        drive.engage()
    return drive


def play(drive: TwinDrive, *programs: Motion) -> Breach | None:
    """Run motions on the physics; return the first breach, None where there was none."""
    for _ in chain(programs):
        breach = drive.tick()
        if breach is not None:
            return breach
    return None


def idle(drive: TwinDrive, n: int) -> Breach | None:
    """Lets ``n`` slices pass, or as many as there are before a breach; returns it."""
    for _ in range(n):
        breach = drive.tick()
        if breach is not None:
            return breach
    return None


def over_the_table(drive: TwinDrive, z: float) -> None:
    """Brings the tool to a free place over the table, ``z`` metres over the base, slowly from above."""
    pose = drive.measured.tcp_pose.copy()
    pose[:3] = (0.40, 0.10, 0.15)
    assert play(drive, drive.motions.moves.movej(pose, is_pose=True)) is None
    pose[2] = z
    assert play(drive, drive.motions.moves.movel(pose, v=0.1)) is None
