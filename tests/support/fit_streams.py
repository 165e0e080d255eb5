"""Ticks of a twin that follows joints, for fits and shadows without a session."""

import msgspec
import numpy as np

from config.loader import resolve
from robot.layout import draw_layout
from robot.messages import ArmCommand, GripCommand
from sim_twin.fitting.stream import TickRow
from sim_twin.plant import TwinPlant

__all__ = ["RAISED_RAD", "Heard", "ticks_of_twin", "waves"]

RAISED_RAD = np.array([0.0, -0.35, -0.2, 0.3, 0.0, 0.0])


class Heard:
    """Implements robot.tick_tap.TickTap: hands measurement and command of each tick on, together."""

    def __init__(self, take):
        self._take, self._state = take, None

    def measured(self, state):
        self._state = state

    def commanded(self, command, limiters, verdict):
        self._take(self._state, command)

    def refused(self, verdict):
        raise AssertionError(verdict)


def waves(home_rad, *, n, tick_s, reach_rad=0.2):
    """Return joints on waves of their own, which begin at rest."""
    t = tick_s * np.arange(n)[:, None]
    hertz = np.array([0.5, 0.4, 0.6, 0.7, 0.9, 1.1])
    return np.asarray(home_rad) + reach_rad * np.sin(2 * np.pi * hertz * t) * np.minimum(1.0, t / 0.5)


def ticks_of_twin(arm, joints_rad, *, tick_s):
    """Let a twin follow joints from rest, and return its ticks."""
    resolved = resolve()
    rig = msgspec.structs.replace(resolved.rig, tick_s=tick_s)
    plant = TwinPlant(arm=arm, scenario=resolved.scenario, rig=rig)
    plant.arm.connect()
    layout = draw_layout(resolved.scenario, np.random.default_rng(0))
    plant.world.put(layout, joints_rad[0].tolist(), 0)
    grip = GripCommand(opening_m=arm.tool.stroke_m, force_n=20.0, speed_m_s=0.1)
    rows = []
    for k, q in enumerate(joints_rad.tolist()):
        state = plant.arm.read()
        command = ArmCommand(stamp_ns=state.stamp_ns, sequence=k, q_rad=tuple(q), grip=grip, digital_out=0)
        rows.append(TickRow(state=state, command=command))
        plant.arm.write(command)
        plant.arm.clock.wait_tick()
    return rows
