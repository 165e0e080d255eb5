"""The genuine ur_rtde client on a virtual controller of its own."""

import time
from contextlib import contextmanager

import numpy as np

from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup

__all__ = ["HOME", "Station", "make_station", "moved", "until"]

HOME = np.array([2.8186, -1.7634, 2.014, -1.8213, -1.5708, -1.8938])


def until(is_true, timeout_s=3.0):
    """Wait in wall time: the client has no other."""
    begun = time.monotonic()
    while not is_true():
        if time.monotonic() - begun > timeout_s:
            return False
        time.sleep(0.005)
    return True


def moved(pose, *way_m):
    """Return a pose with its place moved in the base's axes."""
    return pose + np.array([*way_m, 0, 0, 0])


class Station:
    """A controller, and the genuine control and receive interfaces connected to it."""

    def __init__(self, process, control, receive):
        self.process, self.control, self.receive = process, control, receive

    @property
    def q(self):
        return np.array(self.receive.getActualQ())

    @property
    def pose(self):
        return np.array(self.receive.getActualTCPPose())

    def truth(self):
        return self.process.fault("truth")

    def rest(self):
        """Wait until the joints stand, as the interfaces have it."""
        assert until(lambda: np.abs(self.receive.getActualQd()).max() < 1e-3)
        return self.q

    def recover(self):
        """Leave whatever a test left behind: stops, programs, places."""
        if not self.control.isProgramRunning():
            assert self.control.reuploadScript()
            assert until(self.control.isProgramRunning)
        self.go(HOME)

    def go(self, q):
        if np.abs(self.q - q).max() > 1e-3:
            assert self.control.moveJ(list(q), 2.0, 6.0)
            self.rest()

    def over_the_table(self, height_m):
        """Go to where the tool is a little above the table; its tips are 15 mm lower."""
        pose = self.pose
        pose[:3] = (0.40, 0.10, height_m)
        assert self.control.moveL(list(pose), 0.5, 2.0)
        self.rest()


@contextmanager
def make_station(host, version="5.11.0", **settings):
    from rtde_control import RTDEControlInterface
    from rtde_receive import RTDEReceiveInterface

    with ControllerProcess(Setup(host=host, version=version, **settings)) as process:
        control = RTDEControlInterface(host)
        receive = RTDEReceiveInterface(host)
        yield Station(process, control, receive)
        control.disconnect()
        receive.disconnect()
