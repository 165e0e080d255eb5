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


def test_a_resolved_files_arm_is_held_to_its_tables_workspace_too(tmp_path):
    resolved = resolve(scenario="paper")
    (tmp_path / "wide.yaml").write_text(dump_resolved(msgspec.structs.replace(resolved, arm=ARM)))
    assert load_resolved(tmp_path / "wide.yaml") == resolved
