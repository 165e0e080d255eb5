"""A robot node for tests: real sockets, a fake arm in lock-step."""

import threading

from robot.bus import Bus, Role
from robot.motion import AskedHand, HandReflexes
from robot.node import RobotNode
from robot.rigs import build_station
from robot.tick_notes import TickNotes
from tests.support.stations import fake_rig

__all__ = ["SERIAL", "Node"]

SERIAL = "4711"


class Node:
    """A robot node in a thread, over a fake arm in lock-step."""

    def __init__(self, endpoint, *, is_hub=True, served=lambda station: station, person=None):
        rig = fake_rig()
        notes = TickNotes(rate_hz=1.0 / rig.rig.tick_s)
        self.local = build_station(rig, tap=notes)
        self.bus = Bus(endpoint, serial=SERIAL, role=Role.ROBOT, is_hub=is_hub)
        self.bus.open()
        self.said = []
        self.n_halts, self.is_over = 0, threading.Event()
        self.node = RobotNode(
            self.bus,
            served(self.local),
            scenario=rig.scenario.name,
            profile=rig.rig.profile,
            drive=self.drive,
            halt=self.halt,
            take_notes=notes.take,
            say=self.said.append,
            is_attended=person is not None,
            person=person,
        )
        self.hands = {True: AskedHand(rig.arm), False: HandReflexes(arm=rig.arm, scenario=rig.scenario)}
        self.thread = threading.Thread(target=self.node.run, args=(self.is_over.is_set,))
        self.thread.start()

    def drive(self, is_driven):
        self.local.give_hand(self.hands[is_driven])

    def halt(self):
        self.n_halts += 1

    def close(self):
        self.is_over.set()
        self.thread.join()
        self.bus.close()
