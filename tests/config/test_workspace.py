import msgspec
import pytest

from config.errors import ConfigError
from config.loader import load_arm, load_resolved, load_scenario, resolve, with_rig
from config.resolved import dump_resolved
from config.workspace import fenced

ARM = load_arm("ur5e")
LOW, HIGH = ARM.motion.workspace_m


def scenario(low, high):
    return msgspec.structs.replace(load_scenario("paper"), workspace_m=(low, high))


def test_a_table_without_a_workspace_of_its_own_leaves_the_arm_all_of_it():
    assert fenced(ARM, msgspec.structs.replace(load_scenario("paper"), workspace_m=None), "file") is ARM


def test_motion_and_gate_hold_the_workspace_of_the_table():
    resolved = resolve(scenario="paper")
    assert resolved.arm.motion.workspace_m == resolved.scenario.workspace_m
    assert resolved.arm.motion.workspace_m[1][1] < HIGH[1]
    assert with_rig(resolved, "virtual_lab").arm == resolved.arm


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_workspace_beyond_the_arms_is_refused(axis):
    fenced(ARM, scenario(LOW, HIGH), "file")
    for corner, beyond in ((0, -1e-4), (1, 1e-4)):
        corners = [list(LOW), list(HIGH)]
        corners[corner][axis] += beyond
        with pytest.raises(ConfigError, match="within the arm's workspace") as caught:
            fenced(ARM, scenario(tuple(corners[0]), tuple(corners[1])), "file")
        assert caught.value.where == f"workspace_m[{corner}][{axis}]"


@pytest.mark.parametrize(("corner", "sign"), [(0, 1.0), (1, -1.0)])
def test_a_workspace_holds_the_tools_lowest_and_its_travel_height_over_the_table(corner, sign):
    corners = [list(LOW), list(HIGH)]
    corners[corner][2] = ARM.motion.heights_m[corner]
    fenced(ARM, scenario(tuple(corners[0]), tuple(corners[1])), "file")
    corners[corner][2] += sign * 1e-6
    with pytest.raises(ConfigError, match="height over this table") as caught:
        fenced(ARM, scenario(tuple(corners[0]), tuple(corners[1])), "file")
    assert caught.value.where == f"workspace_m[{corner}][2]"


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("is_fenced", [False, True])
def test_a_table_out_of_the_arms_own_reach_is_told_as_that_whatever_fence_there_is(sign, is_fenced):
    at = (LOW[2] - ARM.motion.heights_m[0], HIGH[2] - ARM.motion.heights_m[1])[sign > 0]
    there = scenario(LOW, HIGH) if is_fenced else msgspec.structs.replace(load_scenario("paper"), workspace_m=None)

    def moved(height_m):
        return msgspec.structs.replace(there, table=msgspec.structs.replace(there.table, height_m=height_m))

    fenced(ARM, moved(at), "file")
    with pytest.raises(ConfigError) as caught:
        fenced(ARM, moved(at + sign * 1e-6), "file")
    assert caught.value.where == "table.height_m"


def test_a_resolved_files_arm_is_held_to_its_tables_workspace_too(tmp_path):
    resolved = resolve(scenario="paper")
    (tmp_path / "wide.yaml").write_text(dump_resolved(msgspec.structs.replace(resolved, arm=ARM)))
    assert load_resolved(tmp_path / "wide.yaml") == resolved
