"""A limits file: what it must say, and what one that does not fit is told."""

import pytest
import yaml
from msgspec.structs import replace

from config.errors import ConfigError
from config.limit_checks import PUSH_N_S_M
from config.limited import FENCE_MARGIN_M, limited
from config.loader import load_arm, load_limits, load_resolved, resolve, with_rig
from config.resolved import dump_resolved
from tests.support.config_files import shipped_tree, write

ARM = load_arm("ur5e")
NAME = "ur5e_parallel_jaw_85"


def rig_with(tmp_path, change, profile="unattended", rig=None):
    """Return the path of a twin's rig whose limits file was changed."""
    tree = shipped_tree("limits", NAME)
    change(tree)
    write(tmp_path, "mine.yaml", tree)
    limits = {"limits": "mine.yaml", "profile": profile}
    return write(tmp_path, "rig.yaml", shipped_tree("rigs", "twin") | limits | (rig or {}))


def put(*path, to):
    """Return what sets the value at a path of a tree."""

    def change(tree):
        for key in path[:-1]:
            tree = tree[key]
        tree[path[-1]] = to

    return change


ATTENDED, UNATTENDED = ("profiles", 0), ("profiles", 1)
BOX, PLANE, OUT = (("workspace", group, 0) for group in ("boxes", "planes", "keep_outs"))


@pytest.mark.parametrize(
    ("change", "where", "words"),
    [
        (put("speed", to=1.0), "", "unknown key"),
        (put(*UNATTENDED, "joints", 2, "jerk_rad_s3", to=0.0), "profiles[1].joints[2].jerk_rad_s3", "above 0"),
        (put(*UNATTENDED, "joints", 2, "range_rad", to=[1.0, -1.0]), "profiles[1].joints[2].range_rad", "lesser value"),
        (put(*UNATTENDED, "joints", 2, "soft_margin_rad", to=2.9), "profiles[1].joints[2].range_rad", "home_rad[2]"),
        (
            lambda tree: put(*UNATTENDED, "joints", 2, "range_rad", to=[1.5, 2.5])(tree)
            or put(*UNATTENDED, "joints", 2, "soft_margin_rad", to=0.5)(tree),
            "profiles[1].joints[2].soft_margin_rad",
            "less than 0.5",
        ),
        (put(*ATTENDED, "speeds", "elbow_m_s", to=0.26), "profiles[0].speeds.elbow_m_s", "at most 0.25"),
        (put(*ATTENDED, "name", to="reduced"), "profiles[0].name", "reduced"),
        (put(*ATTENDED, "name", to="unattended"), "profiles[1].name", "used once"),
        (put(*ATTENDED, "contact_force", "blow_n", to=249.0), "profiles[0].contact_force.blow_n", "at least steady_n"),
        (put(*ATTENDED, "contacts", 1, "force_n", to=699.9), "profiles[0].contacts[1].force_n", "at least 700"),
        (put(*UNATTENDED, "contacts", 2, "speed_m_s", to=0.99), "profiles[1].contacts[2].speed_m_s", "at least 1"),
        (put(*ATTENDED, *BOX, "high_m", to=[0.65, 0.44, 0.0]), "profiles[0].workspace.boxes[0].high_m[2]", "lesser"),
        (put(*ATTENDED, *BOX, "low_m", to=[0.5, -0.44, 0.01]), "profiles[0].workspace.boxes[0]", "at home"),
        (put(*ATTENDED, *BOX, "low_m", to=[0.23, -0.44, 0.025]), "boxes[0].low_m[2]", "the scenario's"),
        (put(*ATTENDED, *PLANE, "normal", to=[0.0, 0.0, 0.0]), "planes[0].normal", "direction"),
        (put(*ATTENDED, *PLANE, "point_m", to=[0.0, 0.0, 0.9]), "planes[0]", "elbow at home"),
        (put(*ATTENDED, *PLANE, "name", to="table_top"), "planes[0].name", "used once"),
        (put(*ATTENDED, *OUT, "high_m", to=[0.8, 0.8, 0.8]), "keep_outs[0]", "tcp at home"),
        (put(*ATTENDED, *OUT, "high_m", to=[-0.1, 0.0, 0.2]), "keep_outs[0].high_m[0]", "at least low_m"),
        (put(*ATTENDED, *OUT, "radius_m", to=0.0), "keep_outs[0].radius_m", "above 0"),
        (put(*ATTENDED, *OUT, "parts", to=["tcp", "tcp"]), "keep_outs[0].parts[1]", "used once"),
        (put(*ATTENDED, *OUT, "parts", to=["wrist"]), "keep_outs[0].parts[0]", "one of tcp, flange, elbow"),
        (put(*ATTENDED, "grip", "force_n", to=[21.0, 235.0]), "profiles[0].grip.force_n", "grip_force_n"),
        (put(*ATTENDED, "grip", "opening_m", to=[0.0, 0.08]), "profiles[0].grip.opening_m", "stroke_m"),
        (put(*ATTENDED, "grip", "speed_m_s", to=[0.2, 0.3]), "profiles[0].grip.speed_m_s", "0.02 to 0.15"),
        (put(*UNATTENDED, "stopping", "distance_m", to=0.01), "profiles[1].stopping.distance_m", "motion takes"),
        (put(*UNATTENDED, "stopping", "time_s", to=0.1), "profiles[1].stopping.time_s", "motion takes"),
        (put("arm", to="ur10e"), "arm", "ur5e, the arm that the rig names"),
        (put("tool", to="hook"), "tool", "parallel_jaw_85"),
    ],
)  # fmt: skip
def test_a_wrong_limits_file_is_told_by_file_key_and_what_to_try(tmp_path, change, where, words):
    with pytest.raises(ConfigError) as told:
        resolve(rig=rig_with(tmp_path, change))
    assert told.value.file.endswith("mine.yaml")
    assert where in told.value.where
    assert words in str(told.value)


def test_a_profile_that_does_not_exist_names_the_rigs_file_and_those_there_are(tmp_path):
    with pytest.raises(ConfigError, match=r"rig\.yaml: profile: .*attended, unattended.*atended \(did you mean"):
        resolve(rig=rig_with(tmp_path, lambda tree: None, profile="atended"))


def test_a_limits_file_that_is_not_there_is_an_error_of_the_rigs_file(tmp_path):
    rig = write(tmp_path, "rig.yaml", shipped_tree("rigs", "twin") | {"limits": "nowhere"})
    with pytest.raises(ConfigError, match=r"rig\.yaml: limits: .*ur5e_parallel_jaw_85"):
        resolve(rig=rig)


def test_a_workspace_that_the_scenario_names_must_be_inside_the_profiles(tmp_path):
    workspace = [[0.25, -0.42, 0.02], [0.63, 0.42, 0.3]]
    scenario = write(tmp_path, "wide.yaml", shipped_tree("scenarios", "paper") | {"workspace_m": workspace})
    resolve(scenario=scenario)
    rig = rig_with(tmp_path, put(*UNATTENDED, *BOX, "low_m", to=[0.255, -0.44, 0.01]))
    with pytest.raises(ConfigError, match=r"boxes\[0\]\.low_m\[0\]: expected at most 0.249, for the scenario's"):
        resolve(rig=rig, scenario=scenario)


def test_unattended_leaves_the_shipped_arm_as_it_is_and_attended_slows_its_tool():
    limits = load_limits(NAME)
    held = limits.profile("unattended")
    left = limited(ARM, held)
    assert replace(left, motion=replace(left.motion, table_clearance_m=ARM.motion.table_clearance_m)) == ARM
    assert left.motion.table_clearance_m == pytest.approx(held.clearances.scene_m - FENCE_MARGIN_M)
    slowed = limited(ARM, limits.profile("attended")).motion
    assert max(slowed.speed_m_s, slowed.guarded_speed_m_s, slowed.max_step_m / slowed.step_s) < 0.25


def test_a_lasting_force_that_bears_a_tool_at_guarded_speed_passes_and_a_little_less_is_refused(tmp_path):
    bears_n = PUSH_N_S_M * ARM.motion.guarded_speed_m_s
    resolve(rig=rig_with(tmp_path, put(*UNATTENDED, "contact_force", "steady_n", to=bears_n)))
    with pytest.raises(
        ConfigError, match=r"profiles\[1\].contact_force.steady_n: expected at least 250, what may press"
    ):
        resolve(rig=rig_with(tmp_path, put(*UNATTENDED, "contact_force", "steady_n", to=bears_n * (1.0 - 1e-6))))


def test_of_two_limits_the_smaller_is_held(tmp_path):
    def change(tree):
        put(*UNATTENDED, "joints", 0, "speed_rad_s", to=0.5)(tree)
        put(*UNATTENDED, "joints", 1, "range_rad", to=[-3.0, 7e-1])(tree)
        put(*UNATTENDED, *BOX, "low_m", to=[0.3, -0.4, 0.01])(tree)
        put(*UNATTENDED, "contact_force", to={"steady_n": 200.0, "blow_n": 900.0})(tree)
        put(*UNATTENDED, "grip", "speed_m_s", to=[0.01, 0.1])(tree)

    rig_with(tmp_path, change)
    held = limited(ARM, load_limits(tmp_path / "mine.yaml").profile("unattended"))
    assert held.joints[0].speed_rad_s == 0.5
    assert held.joints[1].range_rad == (-3.0, 0.7)
    assert held.motion.workspace_m == ((0.301, -0.399, 0.015), (0.64, 0.43, 0.32))
    assert (held.motion.hard_force_n, held.motion.force_limit_n, held.motion.impact_limit_n) == (80.0, 200.0, 700.0)
    assert held.tool.speed_m_s == (0.02, 0.1)


def test_a_run_from_before_there_were_limits_files_gets_the_shipped_one(tmp_path):
    resolved = resolve()
    (tmp_path / "now.yaml").write_text(dump_resolved(resolved))
    assert load_resolved(tmp_path / "now.yaml") == resolved
    tree = yaml.safe_load((tmp_path / "now.yaml").read_text())
    del tree["limits"], tree["rig"]["limits"], tree["rig"]["profile"]
    assert load_resolved(write(tmp_path, "old.yaml", tree)) == resolved
    assert with_rig(resolved, "virtual_lab").limits == resolved.limits
