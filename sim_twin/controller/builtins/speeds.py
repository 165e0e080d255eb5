"""servoj, speedj, speedl, stopj, stopl, direct_torque."""

from sim_twin.controller.builtins.moving import in_slices
from sim_twin.controller.machine import Machine
from sim_twin.controller.motion import SLICE_S, Motion
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import number, vector

__all__ = ["speed_builtins"]


def speed_builtins(machine: Machine) -> Builtins:
    """Return streams of targets, speeds and stops."""
    servoing, speeds = machine.drive.motions.servoing, machine.drive.motions.speeds

    def servoj(
        q: Value, a: Value = 0, v: Value = 0, t: Value = SLICE_S, lookahead_time: Value = 0.1, gain: Value = 300
    ) -> Motion:
        return servoing.servoj(vector(q, 6), number(a), number(v), number(t), number(lookahead_time), number(gain))

    def speedj(qd: Value, a: Value = 1.4, t: Value = 0) -> Motion:
        return speeds.speedj(vector(qd, 6), number(a), number(t))

    def speedl(xd: Value, a: Value = 1.2, t: Value = 0, aRot: Value = "a") -> Motion:  # noqa: N803, ARG001 - UR's name; one acceleration serves both
        return speeds.speedl(vector(xd, 6), number(a), number(t))

    def stopj(a: Value = 2.0) -> Motion:
        return speeds.stopj(number(a))

    def stopl(a: Value = 2.0, aRot: Value = "a") -> Motion:  # noqa: N803, ARG001 - as above
        return speeds.stopl(number(a))

    def direct_torque(
        torque: Value,
        friction_comp: Value = True,  # noqa: ARG001 - the twin's joints have no friction to make up for
        viscous_scale: Value = None,  # noqa: ARG001 - as above
        coulomb_scale: Value = None,  # noqa: ARG001 - as above
    ) -> Motion:
        machine.drive.put_torque(vector(torque, 6))
        yield

    moving = {
        "servoj": servoj,
        "speedj": speedj,
        "speedl": speedl,
        "stopj": stopj,
        "stopl": stopl,
        "direct_torque": direct_torque,
    }
    return {name: in_slices(begin) for name, begin in moving.items()}
