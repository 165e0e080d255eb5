"""What the arm and the table tell of the physics every tick, read in machine code: a dozen arrays, once each."""

from robot.compiled import Table, compiled
from robot.messages import Quat, Vec3, Vec6

__all__ = ["Addresses", "Fingers", "arm_reading", "table_inputs"]

Addresses = tuple[int, int, int, int, int, int, int, int]
"""Of the tool's body and its tree's root, the tool's site, its force sensor, both fingers in qpos and in qvel."""
Fingers = tuple[float, float]
"""How far they are apart, and how fast they part."""


@compiled
def arm_reading(
    qpos: Table, qvel: Table, sites: Table, turns: Table, twists: Table, centres: Table, sensors: Table, at: Addresses
) -> tuple[Vec6, Vec6, Vec3, Quat, Vec3, Vec3, Fingers]:
    """Return joints, their speeds, the tool's place, turn, velocity, the force on it, and the fingers.

    MuJoCo gives a body's velocity at its tree's centre of mass: v_tcp = v + w x (p_tcp - p_com).

    Args:
        qpos: (1, nq), the arm's six first.
        qvel: (1, nv), likewise.
        sites: (nsite, 3) places.
        turns: (nbody, 4) quaternions.
        twists: (nbody, 6) angular and linear velocities.
        centres: (nbody, 3) centres of mass.
        sensors: (1, nsensordata).
        at: where in all of these.
    """
    tool, root, site, force, left, right, left_speed, right_speed = at
    q = (qpos[0, 0], qpos[0, 1], qpos[0, 2], qpos[0, 3], qpos[0, 4], qpos[0, 5])
    qd = (qvel[0, 0], qvel[0, 1], qvel[0, 2], qvel[0, 3], qvel[0, 4], qvel[0, 5])
    place = (sites[site, 0], sites[site, 1], sites[site, 2])
    turn = (turns[tool, 0], turns[tool, 1], turns[tool, 2], turns[tool, 3])
    wx, wy, wz = twists[tool, 0], twists[tool, 1], twists[tool, 2]
    x, y, z = place[0] - centres[root, 0], place[1] - centres[root, 1], place[2] - centres[root, 2]
    speed = (
        twists[tool, 3] + wy * z - wz * y,
        twists[tool, 4] + wz * x - wx * z,
        twists[tool, 5] + wx * y - wy * x,
    )
    on_world = (sensors[0, force], sensors[0, force + 1], sensors[0, force + 2])
    pushed = (0.0 - on_world[0], 0.0 - on_world[1], 0.0 - on_world[2])
    fingers = (qpos[0, left] + qpos[0, right], qvel[0, left_speed] + qvel[0, right_speed])
    return q, qd, place, turn, speed, pushed, fingers


@compiled
def table_inputs(qpos: Table, places: Table, switches: Table, presences: Table, cylinders: Table) -> int:
    """Return the digital inputs as bits, switches with hysteresis.

    Args:
        qpos: (1, nq).
        places: (nbody, 3) of bodies.
        switches: (n, 5) of each button its address in qpos, where it closes and opens (m), its bit, and whether it is
            closed, which is written.
        presences: (n, 5) of each sensor its box's body, half extents across, height up to which it sees (m), its bit.
        cylinders: (n, 1) bodies that it may see.
    """
    bits = 0
    for i in range(switches.shape[0]):
        travel_m = qpos[0, int(switches[i, 0])]
        is_closed = travel_m >= (switches[i, 2] if switches[i, 4] != 0.0 else switches[i, 1])
        switches[i, 4] = 1.0 if is_closed else 0.0
        if is_closed:
            bits |= int(switches[i, 3])
    for i in range(presences.shape[0]):
        box = int(presences[i, 0])
        for k in range(cylinders.shape[0]):
            body = int(cylinders[k, 0])
            x, y = places[body, 0] - places[box, 0], places[body, 1] - places[box, 1]
            z = places[body, 2] - places[box, 2]
            if abs(x) < presences[i, 1] and abs(y) < presences[i, 2] and z < presences[i, 3]:
                bits |= int(presences[i, 4])
    return bits
