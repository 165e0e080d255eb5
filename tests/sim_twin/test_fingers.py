"""The fingers' stops on the twin: metal, whatever swings or presses the fingers apart."""

import mujoco
import pytest

from config.loader import resolve
from sim_twin.allowances import END_STOP_M
from sim_twin.plant import TwinPlant

BLOW_N = 700.0
STEPS, RISE_STEPS = 100, 10
"""A blow rises in 20 ms: the rubber under the fingers gives."""


@pytest.fixture(scope="module")
def world():
    resolved = resolve(rig="twin")
    return TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig).world


@pytest.mark.parametrize("at", ["open", "shut"])
@pytest.mark.parametrize("force_n", [50.0, 250.0, BLOW_N])
@pytest.mark.parametrize("fingers", [("left",), ("right",), ("left", "right")])
def test_fingers_that_are_pressed_as_hard_as_a_blow_go_no_farther_past_their_stops_than_is_allowed_for(
    world, at, force_n, fingers
):
    model, data = world.model, mujoco.MjData(world.model)
    stroke_m, way = world.arm.tool.stroke_m, 1.0 if at == "open" else -1.0
    data.qpos[:6] = world.arm.home_rad
    data.ctrl[world.joint_controls] = world.arm.home_rad
    data.ctrl[world.grip_control] = opening_m = stroke_m if at == "open" else 0.0
    for address in world.finger_addresses:
        data.qpos[address] = opening_m / 2.0
    mujoco.mj_forward(model, data)
    past_m = []
    for k in range(STEPS):
        for name in fingers:
            share = min(1.0, (k + 1) / RISE_STEPS) / len(fingers)
            data.qfrc_applied[model.joint(f"finger_{name}").dofadr[0]] = way * force_n * share
        mujoco.mj_step(model, data)
        opening_m = float(sum(data.qpos[a] for a in world.finger_addresses))
        past_m.append(opening_m - stroke_m if at == "open" else -opening_m)
    assert 0.0 < max(past_m) <= END_STOP_M
