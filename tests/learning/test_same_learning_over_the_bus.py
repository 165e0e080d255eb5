"""Given the same percepts a learner decides the same, whether its station is in its process or behind the bus."""

import socket

import pytest

from learning.assembly import build_agent
from robot.bus import Bus, Role
from robot.node import NodeAsker, RemoteStation
from robot.rigs import build_station
from sim_twin.operator import SimulatedOperator
from tests.support.robot_node import SERIAL, Node
from tests.support.stations import fake_rig

pytestmark = pytest.mark.realtime

HOST = "127.0.0.102"
EPOCHS, SEED = ((0, 0), (1, 3)), 5
"""Epochs and their goals."""


class Recording:
    """A station that keeps what is asked of it and what it answers."""

    def __init__(self, station):
        self._station, self.intents, self.answers = station, [], []

    def __getattr__(self, name):
        return getattr(self._station, name)

    def reset(self, *, seed, epoch):
        self.answers.append(self._station.reset(seed=seed, epoch=epoch))
        return self.answers[-1]

    def step(self, intent, *, duration_s=None):
        self.intents.append(intent)
        self.answers.append(self._station.step(intent, duration_s=duration_s))
        return self.answers[-1]


class Replaying:
    """A station that answers what was recorded, whatever is asked of it."""

    def __init__(self, station, answers):
        self._station, self._answers, self.intents = station, iter(answers), []

    def __getattr__(self, name):
        return getattr(self._station, name)

    def reset(self, *, seed, epoch):
        return next(self._answers)

    def step(self, intent, *, duration_s=None):
        self.intents.append(intent)
        return next(self._answers)


def learn(station):
    agent = build_agent(fake_rig(), station.spec, seed=SEED)
    return [agent.learn_epoch(station, epoch=epoch, seed=epoch, goal=goal) for epoch, goal in EPOCHS]


@pytest.fixture(scope="module")
def recorded():
    station = Recording(build_station(fake_rig()))
    SimulatedOperator().arm_once(station)
    records = learn(station)
    station.close()
    return station, records


def test_recorded_percepts_through_either_station_give_the_same_intents_and_the_same_learning(recorded):
    recording, records = recorded
    assert len(recording.intents) > 100
    at_home = Replaying(recording, recording.answers)
    assert learn(at_home) == records
    made = []
    with socket.create_server((HOST, 0)) as free:
        endpoint = f"tcp/{HOST}:{free.getsockname()[1]}"
    node = Node(endpoint, served=lambda local: made.append(Replaying(local, recording.answers)) or made[0])
    bus = Bus(endpoint, serial=SERIAL, role=Role.LEARNING)
    bus.open()
    station = RemoteStation(bus, asker=NodeAsker(bus, wait_s=5.0))
    try:
        SimulatedOperator().arm_once(station)
        assert learn(station) == records
    finally:
        station.close()
        node.close()
    assert made[0].intents == at_home.intents == recording.intents
