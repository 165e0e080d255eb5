"""One tick of a tool that points down, from its place to the joints, where nothing holds it back. Pure, compiled.

The whole of nearly every tick, in one call: what it is made of is in holding, downward and free, and what it does not
decide is decided there, by the same arithmetic. It may only be too strict.
"""

from robot.compiled import Table, compiled
from robot.downward import near_joints
from robot.geometry import between
from robot.messages import Vec3, Vec6
from robot.motion.commands import joints_of, place_of, put_command
from robot.motion.free import is_free_step
from robot.motion.holding import slid_to

__all__ = ["free_step", "upright_step"]


@compiled
def free_step(
    commands: Table,
    newest: int,
    q: Vec6,
    rows: Table,
    bounds: Table,
    joints: Table,
    fences: Table,
    is_straight: bool,
) -> bool:
    """Return whether nothing holds joints back; then they are written down as the newest command.

    Args:
        commands: Commands.rows.
        newest: which of them is the newest.
        q: the joints.
        rows: the chain's, robot.chain.
        bounds: free_bounds.
        joints: the envelope's.
        fences: likewise.
        is_straight: the tool goes straight.
    """
    n = commands.shape[0]
    now, before = joints_of(commands, newest), joints_of(commands, (newest - 1) % n)
    here = place_of(commands, newest)
    if q == now and q == before:
        return put_command(commands, (newest + 1) % n, q, here)
    past = place_of(commands, (newest + 1) % n)[0], place_of(commands, (newest + 2) % n)[0]
    is_free, there = is_free_step(
        (q, now, before, joints_of(commands, (newest - 2) % n)), place_of(commands, (newest - 1) % n)[0], here, past,
        rows, bounds, joints, fences, is_straight,
    )  # fmt: skip
    return is_free and put_command(commands, (newest + 1) % n, q, there)


@compiled
def upright_step(
    commands: Table,
    newest: int,
    at_m: Vec3,
    to_m: Vec3,
    yaw_rad: float,
    rows: Table,
    reach: Table,
    bounds: Table,
    joints: Table,
    fences: Table,
) -> tuple[bool, Vec6]:
    """Return whether a tool that points down goes to a place in one tick as it is, and its joints there.

    Then they are written down as the newest command. Where a fence leads it elsewhere, no joints near by are found, or
    anything holds the step back, nothing is written, and the joints are those at which it was found.

    Args:
        commands: Commands.rows.
        newest: which of them is the newest.
        at_m: where the tool is.
        to_m: where it goes.
        yaw_rad: its turn about the vertical there.
        rows: the chain's, robot.chain.
        reach: DownwardArm.reach.
        bounds: free_bounds.
        joints: the envelope's.
        fences: likewise.
    """
    b, n = bounds, commands.shape[0]
    now, before = joints_of(commands, newest), joints_of(commands, (newest - 1) % n)
    if slid_to(at_m, to_m, fences, (b[1, 3], b[1, 4], b[1, 5]))[1] >= 0:
        return False, now
    is_found, q = near_joints(
        to_m, yaw_rad, between(before, now, 2.0), joints_of(reach, 0), (b[0, 0], b[0, 1], b[0, 2]), rows,
        joints_of(reach, 1), joints_of(reach, 2),
    )  # fmt: skip
    if not is_found:
        return False, now
    return free_step(commands, newest, q, rows, bounds, joints, fences, True), q
