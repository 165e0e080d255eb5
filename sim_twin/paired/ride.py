"""One errand on two sides: driven by a pilot in lock-step, its intents sent over the wire, and the paths compared."""

from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Self

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from config.loader import resolve
from config.resolved import Resolved
from robot.chain import ToolChain
from robot.messages import Vec6
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_station
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from sim_twin.paired.curves import Distance, Track, compare
from sim_twin.paired.errands import Errand, Kind, drive_errand
from sim_twin.paired.machine import SPARE_SHARE, Spare
from sim_twin.paired.wire import Wire
from sim_twin.plant import TwinPlant

__all__ = ["Compared", "CutShortError", "DisturbedError", "Pair", "wired_rig"]

N_TRIES = 6
BUS_PORT = 7447


class CutShortError(RuntimeError):
    """No try came to its end in time, in most of them though this machine had processor time to spare."""


class DisturbedError(RuntimeError):
    """No try came to its end in time, and this machine was busy in half of them or more."""


class Compared(msgspec.Struct, frozen=True, kw_only=True):
    """One errand on both sides."""

    errand: Errand
    distance: Distance
    start_m: float
    """Distance of the two tools at the start."""


def wired_rig(host: str) -> Resolved:
    """Return the rig virtual_lab for a controller, and its bus, at another loopback address."""
    resolved = resolve(rig="virtual_lab")
    rig = msgspec.structs.replace(resolved.rig, address=host, bus=f"tcp/{host}:{BUS_PORT}")
    return msgspec.structs.replace(resolved, rig=rig)


class Pair:
    """A twin in this process, and a virtual controller in its own with a station of the rig virtual_lab before it.

    Args:
        host: A loopback address that is free.
        n_tries: How often an errand is sent over the wire at most.

    Attributes:
        n_sent: How often errands were sent over the wire so far, disturbed tries too.
    """

    def __init__(self, host: str, *, n_tries: int = N_TRIES) -> None:
        self._wired = wired_rig(host)
        resolved = resolve(rig="twin")
        self._plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
        self._twin = OperatedStation(build_station(resolved, plant=self._plant), build_operator(resolved.rig))
        self._chain = ToolChain(resolved.arm)
        self._rows: list[tuple[float, Vec6]] = []
        self._n_tries, self.n_sent = n_tries, 0
        self._open = ExitStack()

    def __enter__(self) -> Self:
        """Start the controller; the twin is armed, the wire is with the first errand."""
        with ExitStack() as opening:
            self._folder = Path(opening.enter_context(TemporaryDirectory(prefix="autotelic-pair-")))
            trace, rig = self._folder / "trace", self._wired.rig
            assert rig.bus is not None, "wired_rig names one"
            assert rig.cell is not None, "virtual_lab names one"
            assert rig.address is not None, "wired_rig names one"
            opening.enter_context(
                ControllerProcess(Setup(host=rig.address, cell=rig.cell, bus=rig.bus, trace=str(trace)))
            )
            self._wire = Wire(self._wired, trace)
            opening.callback(self._wire.release)
            opening.callback(self._twin.close)
            self._plant.world.step_physics = self._step_twin
            self._twin.connect()
            self._open = opening.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def run(self, kind: Kind, *, seed: int, epoch: int = 0) -> Compared:
        """Drive an errand on the twin, send its intents over the wire and compare the tools' paths.

        Raises:
            DisturbedError: no try came to its end in time on a machine that was busy.
            CutShortError: nor did any on one that was not.
        """
        errand = drive_errand(self._twin, kind=kind, seed=seed, epoch=epoch)
        twin = self._twin_track(len(errand.intents))
        n_spared, told = 0, []
        for _ in range(self._n_tries):
            self.n_sent += 1
            spare = Spare().begin()
            sent = self._wire.send(errand)
            if sent.disturbed is None:
                wire = self._track(sent.t_s, sent.q_rad)
                return Compared(
                    errand=errand,
                    distance=compare(twin, wire),
                    start_m=float(np.linalg.norm(twin.p_m[0] - wire.p_m[0])),
                )
            share = spare.share()
            n_spared += share >= SPARE_SHARE
            told.append(f"{sent.disturbed} ({share:.0%} of the processors' time to spare)")
        error = CutShortError if 2 * n_spared > self._n_tries else DisturbedError
        raise error(f"{kind} of seed {seed}, sent over the wire: {'; '.join(told)}")

    def write_rig(self) -> Path:
        """Return a file of the rig on the wire, for others; it lasts as long as this does."""
        path = self._folder / "virtual_lab.yaml"
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

    def _track(self, t_s: NDArray[np.floating], q_rad: NDArray[np.floating]) -> Track:
        """Return the tool's track, its time from 0 on.  (n,), (n, 6)"""
        t_s = np.asarray(t_s, dtype=np.float64)
        return Track(t_s=t_s - t_s[0], p_m=np.array([self._chain.tcp(_vec6(q)) for q in q_rad]))


def _vec6(values: NDArray[np.floating]) -> Vec6:
    a, b, c, d, e, f = values.tolist()
    return a, b, c, d, e, f
