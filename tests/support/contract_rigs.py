"""Rigs as the contract suite sees them: how their plants and stations come to be, and what they promise of time."""

import gc
from contextlib import ExitStack
from functools import cached_property

import msgspec

from config.loader import resolve
from robot.errors import StaleStateError
from robot.hal.ur_state import Runtime
from robot.messages import StationMode
from robot.rigs import build_operator, build_plant, build_station

__all__ = ["WORLDS", "LockStepWorld", "WireWorld", "open_world"]


def open_world(name):
    """Return what stands behind a rig; close it when it is no longer needed."""
    return WORLDS[name](resolve(rig=name, scenario="paper", learning="default"))


class LockStepWorld:
    """A plant in this process. Every test gets one of its own: they cost nothing.

    Attributes:
        is_lock_step: Time passes in wait_tick alone, so that no tick is missed, reading costs no time, and the same
            seed and commands give the same measurements bit for bit. Elsewhere time is the wall's, and the same holds
            within what some milliseconds of it make.
        n_steps: How long an episode is compared with another: where time is the wall's, as long as it takes to move on
            from the start, turn, sink and rise.
        recording: What a module recorded once, None before.
    """

    is_lock_step, n_steps = True, 60

    def __init__(self, resolved):
        self.resolved, self.recording = resolved, None

    def fresh(self):
        """Return a plant that nobody has connected to."""
        resolved = self.resolved
        return build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)

    def plant(self):
        """Return a connected plant after a reset."""
        plant = self.fresh()
        plant.arm.connect()
        plant.resetter.reset(seed=1, epoch=0, digital_out=0)
        return plant

    def station(self, resolved=None):
        """Return a disarmed station, an arm that tells what its arm does, and its operator."""
        plant = self.fresh()
        resolved = resolved or self.resolved
        return build_station(resolved, plant=plant), plant.arm, build_operator(resolved.rig)

    def standing(self):
        """Return an engaged station, its witness and its operator, wherever its arm stands."""
        station, witness, operator = self.station()
        operator.arm_once(station)
        return station, witness, operator

    def engaged(self):
        """Return the same after a reset."""
        made = self.standing()
        made[0].reset(seed=1, epoch=0)
        return made

    def is_released(self, witness):
        """Tell whether nobody holds the arm of a station any more."""
        try:
            witness.read()
        except StaleStateError:
            return True
        return False

    def leave(self, station):
        """Take a station back after a test."""
        station.close()

    def renew(self):
        """Let a failed test be repeated; here every test begins anew anyway."""

    def close(self):
        """Nothing is held."""


class WirePlant:
    """The plant of a rig with a bus, whole in one process: the arm at its address, truth and resets over the bus."""

    def __init__(self, resolved, bus):
        from robot.bus.twin_link import RemoteResetter, RemoteTruth

        self._plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)
        self.arm, self.cameras = self._plant.arm, self._plant.cameras
        self.truth = RemoteTruth(bus)
        self.resetter = RemoteResetter(bus, loop=self, truth=self.truth)

    def stop(self):
        self.arm.stop()

    def await_rest(self):
        """Return: this arm waits for that in its stop."""

    @property
    def identity(self):
        return self._plant.identity


class WireWorld:
    """A virtual controller in a process of its own and the genuine client: time is the wall's.

    Plant and station are shared by the tests of a module, each brought to its start by a reset: to connect, to have the
    watchdog proven and to let go again takes the client two seconds. What a station's arm does is read by another
    client, which the station knows nothing of.
    """

    is_lock_step, n_steps = False, 16

    def __init__(self, resolved):
        from sim_twin.controller.process import ControllerProcess
        from sim_twin.controller.server import Setup
        from tests.support.loopback import own_address

        host = own_address()
        rig = msgspec.structs.replace(resolved.rig, address=host, bus=f"tcp/{host}:7447")
        self.resolved = msgspec.structs.replace(resolved, rig=rig)
        self._open, self.recording = ExitStack(), None
        self.controller = self._open.enter_context(ControllerProcess(Setup(host=host, bus=rig.bus)))

    @cached_property
    def _bus(self):
        from robot.bus import Bus, Role

        rig = self.resolved.rig
        return self._open.enter_context(Bus(rig.bus, serial=rig.expected.serial, role=Role.LEARNING))

    @cached_property
    def _plant(self):
        plant = self.fresh()
        self._open.callback(plant.arm.close)
        return plant

    @cached_property
    def _witness(self):
        arm = self.fresh().arm
        arm.connect()
        self._open.callback(arm.close)
        return arm

    @cached_property
    def _station(self):
        station = build_station(self.resolved)
        self._open.callback(station.close)
        return station

    def fresh(self):
        return WirePlant(self.resolved, self._bus)

    def plant(self):
        self._plant.arm.connect()
        self._plant.resetter.reset(seed=1, epoch=0, digital_out=0)
        return self._plant

    def station(self, resolved=None):
        resolved = resolved or self.resolved
        return build_station(resolved), self._witness, build_operator(resolved.rig)

    def standing(self):
        station, operator = self._station, build_operator(self.resolved.rig)
        if station.state.mode is StationMode.DISARMED:
            operator.arm_once(station)
        elif station.state.mode is StationMode.LATCHED:
            operator.rearm(station, seed=1, epoch=0)
        return station, self._witness, operator

    def engaged(self):
        was_latched = self._station.state.mode is StationMode.LATCHED
        station, witness, operator = self.standing()
        if not was_latched:
            station.reset(seed=1, epoch=0)
        return station, witness, operator

    def is_released(self, witness):
        witness.clock.wait_tick()
        return witness.status().runtime == Runtime.STOPPED

    def leave(self, station):
        if station is not self._station:
            station.close()

    def renew(self):
        """Let a failed test be repeated, on another plant and record: one that saw its link stall may be used no more.

        A process of its own would end; here closing the arm ends its clients. To forget them is not enough: whatever
        tells of the failure holds the frames that it came through, and who watches a link holds its descriptor.
        """
        self.recording = None
        plant = self.__dict__.pop("_plant", None)
        if plant is not None:
            plant.arm.close()
        gc.collect()  # an error and the frames that it came through hold one another, and a client with them

    def close(self):
        self._open.close()


WORLDS = {"fake": LockStepWorld, "twin": LockStepWorld, "virtual_lab": WireWorld}
"""What the suite runs on, by the names of the rigs."""
