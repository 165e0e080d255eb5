"""The live view: a page on loopback that follows what is measured and perceived."""

import socket
import urllib.request

import numpy as np
import pytest

from config.loader import resolve
from robot.messages import Grip, Hold, Twist
from robot.rigs import build_plant, build_station, build_view
from sim_twin.operator import SimulatedOperator
from sim_twin.plant import TwinWorld
from sim_twin.posing import posed_numbers, world_of_numbers


@pytest.fixture
def driven():
    resolved = resolve(rig="twin", scenario="paper")
    plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)
    station = build_station(resolved, plant=plant)
    SimulatedOperator().arm_once(station)
    station.reset(seed=5, epoch=0)
    yield station, plant, resolved
    station.close()


def test_what_is_shown_is_where_arm_hand_and_things_are(driven):
    station, plant, resolved = driven
    for _ in range(40):
        station.step(Twist(linear_m_s=(0.05, 0.1, 0.0), grip=Grip.CLOSE))
    station.step(Hold(grip=Grip.CLOSE))
    shown = TwinWorld(resolved.arm, resolved.scenario, resolved.rig)
    assert world_of_numbers(shown, posed_numbers(station.measured, station.percept))
    assert not world_of_numbers(shown, posed_numbers(station.measured, station.percept)), "no fixture moved since"
    real, its = plant.world, shown
    there = its.data.site_xpos[its.model.site("tcp").id]
    assert there == pytest.approx(real.data.site_xpos[real.model.site("tcp").id], abs=1e-3)  # a step of physics apart
    for i in range(1, real.model.nbody):
        name = real.model.body(i).name
        if "leaf" in name or "cap" in name:
            continue
        away = np.linalg.norm(real.data.xpos[i] - its.data.xpos[its.model.body(name).id])
        assert away < 2e-3, f"{name} is shown {1e3 * away:.1f} mm off"


def test_without_a_screen_it_is_a_page_that_listens_to_this_machine_only(driven, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    station, _, resolved = driven
    view = build_view(resolved)
    try:
        where = view.open()
        view.show(station.measured, station.percept)
        assert where.startswith("http://127.0.0.1:")
        assert b"<html" in urllib.request.urlopen(where, timeout=10).read()
        port = int(where.rstrip("/").rpartition(":")[2])
        with pytest.raises(OSError, match="refused"):
            socket.create_connection(("127.0.0.2", port), timeout=2).close()
    finally:
        view.close()
        view.close()
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", port), timeout=2).close()
