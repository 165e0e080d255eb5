"""One errand on the twin in lock-step and, from the same reset, through servo process, client and controller."""

from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from types import TracebackType
from typing import Self

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from config.loader import resolve
from config.resolved import Resolved
from robot.errors import RobotError
from robot.kinematics import ToolChain
from robot.messages import Vec6
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_station
from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from sim_twin.controller.trace import read_trace
from sim_twin.paired.curves import Distance, Track, compare
from sim_twin.paired.errands import Errand, Kind, drive_errand
from sim_twin.plant import TwinPlant

__all__ = ["Compared", "DisturbedError", "Pair", "wired_rig"]

N_TRIES = 6
LOST_S = 0.02
"""Where a controller's own time fell so far behind, the set-point ran ahead of the arm, which then cut its corners."""
LATE_S = 0.05
"""Where a servo process lost so much time, the arm caught up with a set-point that stood still: fuller corners."""
BUS_PORT = 7447


class DisturbedError(RuntimeError):
    """Every try was cut short: this machine was busy elsewhere for too long."""


class Compared(msgspec.Struct, frozen=True, kw_only=True):
    """One errand on both sides."""

    errand: Errand
    distance: Distance
    start_m: float
    """Distance of the two tools at the start."""
    n_disturbed: int
    """Tries on the wire that were cut short before."""


def wired_rig(host: str) -> Resolved:
    """Return the rig virtual_lab for a controller, and its bus, at another loopback address."""
    resolved = resolve(rig="virtual_lab")
    rig = msgspec.structs.replace(resolved.rig, address=host, bus=f"tcp/{host}:{BUS_PORT}")
    return msgspec.structs.replace(resolved, rig=rig)


class Pair:
    """A twin in this process, and a virtual controller in its own with a station of the rig virtual_lab before it.

    Args:
        host: A loopback address that is free.

    Attributes:
        n_tries: How often an errand was sent over the wire, disturbed ones too.
    """

    def __init__(self, host: str) -> None:
        self._folder = TemporaryDirectory(prefix="autotelic-pair-")
        self._trace = Path(self._folder.name) / "trace"
        self._wired = wired_rig(host)
        rig = self._wired.rig
        assert rig.bus is not None, "virtual_lab names one"
        assert rig.cell is not None, "virtual_lab names one"
        self._controller = ControllerProcess(Setup(host=host, cell=rig.cell, bus=rig.bus, trace=str(self._trace)))
        resolved = resolve(rig="twin")
        self._plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
        self._twin = OperatedStation(build_station(resolved, plant=self._plant), build_operator(resolved.rig))
        self._chain = ToolChain(resolved.arm)
        self._rows: list[tuple[float, Vec6]] = []
        self._plant.world.step_physics = self._step_twin
        self._wire: OperatedStation | None = None
        self.n_tries = 0

    def __enter__(self) -> Self:
        """Start the controller; the twin is armed, the wire is with the first errand."""
        self._controller.__enter__()
        self._twin.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()
        self._controller.close()
        self._twin.close()
        self._folder.cleanup()

    def run(self, kind: Kind, *, seed: int, epoch: int = 0) -> Compared:
        """Drive an errand on the twin, send its intents over the wire and compare the tools' paths.

        Raises:
            DisturbedError: the wire's station latched each time.
        """
        errand = drive_errand(self._twin, kind=kind, seed=seed, epoch=epoch)
        twin = self._twin_track(len(errand.intents))
        for n_disturbed in range(N_TRIES):
            self.n_tries += 1
            wire = self._send(errand)
            if wire is not None:
                return Compared(
                    errand=errand,
                    distance=compare(twin, wire),
                    start_m=float(np.linalg.norm(twin.p_m[0] - wire.p_m[0])),
                    n_disturbed=n_disturbed,
                )
        raise DisturbedError(f"errand of seed {seed}: cut short {N_TRIES} times over the wire")

    def release(self) -> None:
        """Let go of the arm on the wire; the next errand takes it again. Idempotent."""
        wire, self._wire = self._wire, None
        if wire is not None:
            wire.close()

    def write_rig(self) -> Path:
        """Return a file of the rig on the wire, for others; it lasts as long as this does."""
        path = Path(self._folder.name) / "virtual_lab.yaml"
        path.write_bytes(msgspec.yaml.encode(self._wired.rig))
        return path

    def _step_twin(self, model: mujoco.MjModel, data: mujoco.MjData, nstep: int) -> None:
        mujoco.mj_step(model, data, nstep)
        self._rows.append((data.time, _vec6(data.qpos[:6])))

    def _twin_track(self, n_steps: int) -> Track:
        """Return where the twin's tool was in its last so many time steps."""
        n_ticks = n_steps * round(self._twin.spec.step_s / self._plant.world.tick_s)
        rows, self._rows = self._rows[-n_ticks - 1 :], []
        return self._track(np.array([t for t, _ in rows]), np.array([q for _, q in rows]))

    def _send(self, errand: Errand) -> Track | None:
        """Send an errand's intents over the wire; None where it was disturbed."""
        try:
            if self._wire is None:
                self._wire = OperatedStation(build_station(self._wired), build_operator(self._wired.rig))
                self._wire.connect()
            self._wire.reset(seed=errand.seed, epoch=errand.epoch)
            times_s = [monotonic()]
            for intent in errand.intents:
                if self._wire.step(intent).is_void:
                    return None
                times_s.append(monotonic())
                if times_s[-1] - times_s[-2] > self._wired.arm.motion.intent_max_age_s:
                    return None  # an intent grew too old meanwhile and the arm was braked, as it should be
        except RobotError:
            self.release()
            return None
        rows = read_trace(self._trace, since_s=times_s[0])
        rows = rows[rows[:, 0] <= times_s[-1]]
        spent_s = float(np.ptp(rows[:, 1])) * SLICE_S
        lost_s = float(np.ptp(rows[:, 0])) - spent_s
        late_s = spent_s - len(errand.intents) * self._wire.spec.step_s
        if lost_s > LOST_S or late_s > LATE_S:
            return None
        return self._track(SLICE_S * rows[:, 1], rows[:, 3:9])

    def _track(self, t_s: NDArray[np.floating], q_rad: NDArray[np.floating]) -> Track:
        """Return the tool's track, its time from 0 on.  (n,), (n, 6)"""
        t_s = np.asarray(t_s, dtype=np.float64)
        return Track(t_s=t_s - t_s[0], p_m=np.array([self._chain.tcp(_vec6(q)) for q in q_rad]))


def _vec6(values: NDArray[np.floating]) -> Vec6:
    a, b, c, d, e, f = values.tolist()
    return a, b, c, d, e, f
