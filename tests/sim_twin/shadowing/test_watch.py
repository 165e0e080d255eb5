"""The shadow on a real bus: a virtual arm in this process tells its ticks, and hears stop."""

import threading

import msgspec
import numpy as np
import pytest

from robot.bus import Bus, Role
from robot.bus.errors import BusConfigError
from robot.bus.station_rows import StationReport
from robot.bus.tick_rows import pack_ticks
from robot.bus.topics import REPORT, STOP, TICKS
from robot.messages import StationMode, StationState
from robot.tick_ring import Tick
from sim_twin.fitting.trial import Differing, Driven, trial_config
from sim_twin.shadowing.beside import Bounds
from sim_twin.shadowing.watch import BusShadow, open_bus
from tests.support.fit_streams import Heard
from tests.support.loopback import own_address

SEED, BATCH = 970, 20


class Arm:
    """A robot node's part of the bus: ticks of a virtual arm, and stops that it confirms."""

    def __init__(self, endpoint, serial, *, different):
        self.bus = Bus(endpoint, serial=serial, role=Role.ROBOT, is_hub=True)
        self.bus.open()
        self.stops, self.is_stopped = [], threading.Event()
        self._ticks, self._reports = self.bus.publisher(TICKS), self.bus.publisher(REPORT)
        self._heard = self.bus.subscriber(STOP, self._stop)
        self._driven = Driven(trial_config(), different, seed=SEED)
        self._batch = []

    def _stop(self, received):
        self.stops.append(received.message)
        self.is_stopped.set()
        state = StationState(mode=StationMode.LATCHED, reason="stopped")
        numbers = tuple(ask.number for ask in self.stops)
        self._reports.put(StationReport(revision=len(numbers), begun=1, state=state, stops=numbers))

    def move(self, seconds):
        self._driven.follow(self._driven.moves(np.random.default_rng([SEED, 3]), seconds), Heard(self._tell))

    def _tell(self, state, command):
        tick = Tick(state.stamp_ns, state.stamp_ns, state, command)
        self._batch.append(msgspec.msgpack.encode(tick))
        if len(self._batch) == BATCH:
            self._ticks.put(pack_ticks(self._batch, n_missed=0))
            self._batch = []

    def close(self):
        self.bus.close()


def shadowed(different, *, bounds, says_stop=True, seconds=2.5):
    config = trial_config()
    rig = msgspec.structs.replace(config.rig, bus=f"tcp/{own_address()}:7447")
    config = msgspec.structs.replace(config, rig=rig)
    arm = Arm(rig.bus, rig.expected.serial, different=different)
    told = []
    try:
        with open_bus(config) as bus:
            shadow = BusShadow(bus, config, bounds=bounds, says_stop=says_stop)
            is_moved = threading.Event()

            def move():
                arm.move(seconds)
                is_moved.set()

            thread = threading.Thread(target=move)
            thread.start()
            n_ticks = round(seconds / 0.002) // BATCH * BATCH
            shadow.run(lambda: is_moved.is_set() and shadow.n_ticks >= n_ticks, tell=told.append)
            thread.join()
            shadow.close()
    finally:
        arm.close()
    return arm, shadow, told


@pytest.mark.realtime
def test_a_bound_that_is_passed_stops_the_arm_over_the_bus():
    arm, shadow, told = shadowed(Differing(payload_kg=1.5), bounds=Bounds(q_rad=1e-3))
    assert shadow.beside.latched.what == "joints"
    assert arm.is_stopped.is_set()
    assert {ask.by for ask in arm.stops} == {"shadow"}
    assert shadow.stopped_s is not None
    assert told


@pytest.mark.realtime
def test_an_arm_that_stays_with_its_twin_is_not_stopped():
    arm, shadow, _ = shadowed(Differing(), bounds=Bounds())
    assert shadow.beside.latched is None
    assert not arm.stops
    assert shadow.n_ticks == 1240
    assert shadow.beside.n_compared > 1000


@pytest.mark.realtime
def test_who_only_looks_says_no_stop():
    arm, shadow, _ = shadowed(Differing(payload_kg=1.5), bounds=Bounds(q_rad=1e-3), says_stop=False)
    assert shadow.beside.latched is not None
    assert not arm.stops


def test_a_shadow_may_write_nothing_but_stop():
    config = trial_config()
    rig = msgspec.structs.replace(config.rig, bus=f"tcp/{own_address()}:7447")
    config = msgspec.structs.replace(config, rig=rig)
    with Bus(rig.bus, serial=rig.expected.serial, role=Role.ROBOT, is_hub=True), open_bus(config) as bus:
        with pytest.raises(BusConfigError):
            bus.publisher(TICKS)
        bus.publisher(STOP)
