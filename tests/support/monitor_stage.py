"""A twin whose physics a test sets by hand, recorded, and judged by the monitor."""

import msgspec
import mujoco

from config.limits import Profile
from config.resolved import Resolved
from sim_twin.allowances import allowances_for
from sim_twin.monitor import Monitor
from sim_twin.perturb import NOMINAL, perturbed_plant
from sim_twin.readings import Reading
from sim_twin.recorder import Recorder

__all__ = ["N_TICKS", "Stage"]

replace = msgspec.structs.replace
N_TICKS = 150


class Stage:
    """A twin whose physics is set by hand, recorded, and judged."""

    def __init__(self, resolved: Resolved) -> None:
        self.plant = perturbed_plant(resolved, NOMINAL)
        attended = resolved.limits.profile("attended")
        joints = tuple(
            replace(
                j,
                speed_rad_s=1.0,
                acceleration_rad_s2=10.0,
                jerk_rad_s3=400.0,
                stop_acceleration_rad_s2=20.0,
                stop_jerk_rad_s3=1500.0,
            )
            for j in attended.joints
        )
        self.world, self.profile = self.plant.world, replace(attended, joints=joints)
        self.recorder = Recorder(self.world, most_ticks=N_TICKS)
        self.plant.arm.connect()
        self.lay_out()

    def lay_out(self, digital_out: int = 0) -> None:
        self.plant.resetter.reset(seed=0, epoch=0, digital_out=digital_out)
        self.recorder.clear()

    @property
    def data(self) -> mujoco.MjData:
        return self.world.data

    def put(self, q=None, qd=None) -> None:
        if q is not None:
            self.data.qpos[:6] = q
            self.data.ctrl[self.world.joint_controls] = q
        self.data.qvel[:6] = 0.0 if qd is None else qd

    def tick(self, n: int = 1) -> None:
        for _ in range(n):
            self.world.advance()

    def judge(self, profile: Profile | None = None) -> dict[str, Reading]:
        held = profile or self.profile
        monitor = Monitor(self.world, held, allowances_for(held, NOMINAL))
        return {r.limit: r for r in monitor.judge(self.recorder.course())}
