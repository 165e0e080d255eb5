"""Which arm stands at an address: asked of its controller before anything else is opened. Moves and stops nothing."""

import msgspec
from dashboard_client import DashboardClient

from config.arm import ArmConfig
from robot.hal.ur_calls import named
from robot.hal.ur_checks import check_facts, check_pose, check_serial
from robot.hal.ur_primary import ArmFacts, read_facts
from robot.hal.ur_state import check_version, parse_version

__all__ = ["Identified", "identify"]


class Identified(msgspec.Struct, frozen=True, kw_only=True):
    """An arm that is the one it should be."""

    serial: str
    facts: ArmFacts
    dashboard: DashboardClient
    """Connected."""


def identify(*, address: str, arm: ArmConfig, serial: str | None) -> Identified:
    """Return what an arm says it is, where that is what was expected.

    Args:
        address: host or IP address of its controller.
        arm: the arm's file.
        serial: the number that it must say it has; None takes any.

    Raises:
        WireError: somebody does not answer.
        RobotConfigError: another arm than expected, another model or software than this package is for.
    """
    facts = read_facts(address, greeted=check_version)  # PolyScope X has no dashboard that could be asked
    dashboard = DashboardClient(address)
    with named("dashboard", address):
        dashboard.connect()
        version = parse_version(dashboard.polyscopeVersion())
        found = dashboard.getSerialNumber().strip()
    if serial is not None:
        check_serial(found, serial, address)
    check_version(version)
    check_facts(facts, arm)
    check_pose(facts)
    return Identified(serial=found, facts=facts, dashboard=dashboard)
