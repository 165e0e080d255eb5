"""A servo process's time steps over the twin, without a wall clock: the same intents, the same path as a station's."""

import msgspec
import numpy as np
import pytest

from config.loader import resolve
from robot.chain import ToolChain
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_station
from sim_twin.paired import Kind, Track, compare, drive_errand
from sim_twin.plant import TwinPlant
from tests.support.hand_served import HandServed

pytestmark = pytest.mark.realtime

LOCK_STEP_TICK_S, WIRE_TICK_S = 0.01, 0.002
SEEDS = (1, 3)
PRESS_SEEDS = (1, 3)
FRECHET_M = 1.5e-3


class Driven:
    """A twin whose joints are noted every 2 ms of its time."""

    def __init__(self, tick_s):
        twin = resolve(rig="twin")
        self.resolved = msgspec.structs.replace(twin, rig=msgspec.structs.replace(twin.rig, tick_s=tick_s))
        self.plant = TwinPlant(arm=twin.arm, scenario=twin.scenario, rig=self.resolved.rig)
        self._step = self.plant.world.step_physics
        self.plant.world.step_physics = self.note
        self.rows = []

    def note(self, model, data, n_substeps):
        for _ in range(n_substeps):
            self._step(model, data, 1)
            self.rows.append((data.time, *data.qpos[:6]))

    def track(self, n_steps):
        """Return where the tool was in the last so many time steps."""
        n_rows = round(n_steps * self.resolved.arm.motion.step_s / WIRE_TICK_S)
        rows, chain = np.array(self.rows[-n_rows:]), ToolChain(self.resolved.arm)
        return Track(t_s=rows[:, 0] - rows[0, 0], p_m=np.array([chain.tcp(tuple(q)) for q in rows[:, 1:].tolist()]))


def driven_in_lock_step(kind, seeds):
    """Return errands and the tracks that a station in lock-step left, by seed."""
    twin = Driven(LOCK_STEP_TICK_S)
    station = OperatedStation(build_station(twin.resolved, plant=twin.plant), build_operator(twin.resolved.rig))
    station.connect()
    driven = {}
    for seed in seeds:
        errand = drive_errand(station, kind=kind, seed=seed, epoch=0)
        driven[seed] = errand, twin.track(len(errand.intents))
    station.close()
    return driven


@pytest.fixture(scope="module")
def errands():
    return driven_in_lock_step(Kind.MOVES, SEEDS)


@pytest.fixture(scope="module")
def presses():
    return driven_in_lock_step(Kind.PRESS, PRESS_SEEDS)


@pytest.mark.parametrize("most_decided", [0, 5])
@pytest.mark.parametrize("seed", SEEDS)
def test_corners_at_full_speed_are_the_lock_step_stations_whatever_a_decision_takes(errands, seed, most_decided):
    errand, expected = errands[seed]
    wire = Driven(WIRE_TICK_S)
    served = HandServed(wire.resolved, wire.plant)
    wire.plant.resetter.reset(seed=errand.seed, epoch=errand.epoch, digital_out=served.loop.begin_epoch(errand.epoch))
    served.seed()
    rng = np.random.default_rng([seed, most_decided])
    n_ticks = round(wire.resolved.arm.motion.step_s / WIRE_TICK_S)
    limiters = set()
    for intent in errand.intents:
        stride = served.stride(intent, n_ticks=n_ticks, n_decided=int(rng.integers(most_decided + 1)))
        limiters.update(stride.limiters)
    found = compare(expected, wire.track(len(errand.intents)))
    assert "leash" in limiters, "an errand that meets no leash proves nothing of it"
    assert found.frechet_m < FRECHET_M
    assert found.length_m > 0.3
    assert 0.0 <= found.offset_s < 0.04  # an intent sets out 12 ms after it came, where ticks are short


@pytest.mark.parametrize("seed", PRESS_SEEDS)
def test_a_tool_that_pressed_a_button_rises_as_the_lock_step_stations_does(presses, seed):
    """The push bends the joints: taken back all at once, tick by tick, that held the arm down for good."""
    errand, expected = presses[seed]
    wire = Driven(WIRE_TICK_S)
    served = HandServed(wire.resolved, wire.plant)
    wire.plant.resetter.reset(seed=errand.seed, epoch=errand.epoch, digital_out=served.loop.begin_epoch(errand.epoch))
    served.seed()
    n_ticks = round(wire.resolved.arm.motion.step_s / WIRE_TICK_S)
    for intent in errand.intents:
        served.stride(intent, n_ticks=n_ticks, n_decided=0)
    found = wire.track(len(errand.intents))
    heights_m = found.p_m[:, 2]
    assert heights_m.min() < 0.06
    assert heights_m[-1] > 0.2
    assert compare(expected, found).frechet_m < FRECHET_M
