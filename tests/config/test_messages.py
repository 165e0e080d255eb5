"""Each thing that can be wrong with a file is told by file, place, what was expected and what came."""

# ruff: noqa: E501  (one row a case)

import copy

import pytest

from config.errors import ConfigError
from config.kinds import LOADERS, Kind
from config.loader import load_rules, load_scenario, resolve
from tests.support.config_files import FOLDERS, shipped_tree, write

CYLINDER = {"name": "extra", "position_m": [0.44, 0.33], "colour": [0, 0, 0]}


def put(tree, path, value):
    """Set what lies at a path of keys and indices; an index just past a list's end appends, ... deletes."""
    *way, last = path
    for key in way:
        tree = tree[key]
    if value is ...:
        del tree[last]
    elif isinstance(tree, list) and last == len(tree):
        tree.append(value)
    else:
        tree[last] = value


def refusal(load, *args, **kwargs):
    with pytest.raises(ConfigError) as caught:
        load(*args, **kwargs)
    return caught.value


def case(name, kind, path, value, where, expected, got):
    return pytest.param(kind, path, value, where, expected, got, id=name)


TYPES = [
    case("unknown key", "scenario", ["boxes", 1, "lid", "outptu"], 4, "boxes[1].lid", "the keys output", "'outptu' (did you mean output?)"),
    case("unknown top key", "rig", ["plants"], "x", "", "the keys name, description, arm", "'plants' (did you mean plant?)"),
    case("missing key", "scenario", ["buttons", 0, "input"], ..., "buttons[0].input", "a whole number from 0 up to 15", "no such key"),
    case("missing part", "arm", ["tool"], ..., "tool", "a mapping", "no such key"),
    case("text for a number", "arm", ["joints", 2, "a_m"], "long", "joints[2].a_m", "a number from -3 up to 3", "'long'"),
    case("truth for a number", "rig", ["tick_s"], True, "tick_s", "a number from 0.002 up to 0.05", "True"),
    case("number for truth", "learning", ["goal_selection", "rearm"], 1, "goal_selection.rearm", "true or false", "1"),
    case("fraction for a whole", "scenario", ["buttons", 0, "input"], 0.5, "buttons[0].input", "a whole number", "0.5"),
    case("word in a list that may be absent", "scenario", ["workspace_m"], [[0.3, -0.4, "low"], [0.6, 0.4, 0.3]], "workspace_m[0][2]", "a number", "'low'"),
    case("mapping for a list", "scenario", ["goals"], {}, "goals", "a list of at least 1", "a mapping"),
    case("list for a mapping", "arm", ["servo"], [1], "servo", "a mapping", "a list of 1"),
    case("nothing", "arm", ["servo"], None, "servo", "a mapping", "nothing"),
    case("too many in a point", "arm", ["tool", "tcp_m"], [0, 0, 0, 0], "tool.tcp_m", "a list of 3, each a number", "a list of 4"),
    case("too few joints", "arm", ["joints", 5], ..., "joints", "a list of 6, each a mapping", "a list of 5"),
    case("too great", "scenario", ["boxes", 0, "lid", "output"], 99, "boxes[0].lid.output", "from 0 up to 15", "99"),
    case("not above", "arm", ["servo", "gain"], 0, "servo.gain", "a number from 100 up to 2000", "0"),
    case("choice", "learning", ["subgoal_selection", "kind"], "magic", "subgoal_selection.kind", "one of direct, graph, mdp, q, q_drop, q_hindsight", "'magic'"),
    case("goal kind", "scenario", ["goals", 0, "kind"], "pushed", "goals[0].kind", "one of pressed, grabbed, in_box", "'pushed'"),
    case("key like a path", "rig", ["x` - at `$.foo"], 1, "", "the keys name, description, arm", "'x` - at `$.foo'"),
    case("key like a path below", "scenario", ["boxes", 1, "lid", "x` - at `$.foo[3]"], 1, "boxes[1].lid", "the keys output", "'x` - at `$.foo[3]'"),
    case("choice like a path", "scenario", ["goals", 0, "kind"], "x' - at `$.foo[3]`", "goals[0].kind", "one of pressed, grabbed, in_box", "x' - at `$.foo[3]`"),
    case("name form", "rules", ["name"], "My Rules", "name", "like [a-z][a-z0-9_]*", "'My Rules'"),
    case("name with a line end", "rules", ["name"], "paper\n", "name", "like [a-z][a-z0-9_]*", r"'paper\n'"),
    case("import string", "rig", ["plant"], "sim_twin.plant", "plant", "text like", "'sim_twin.plant'"),
    case("empty list", "learning", ["expert"], {"hidden": []}, "expert.hidden", "a list of at least 1", "a list of 0"),
]  # fmt: skip

ARMS = [
    case("range inside out", "arm", ["joints", 1, "range_rad"], [1, -1], "joints[1].range_rad", "the lesser value first", "1 and -1"),
    case("home out of range", "arm", ["home_rad", 2], 4.0, "home_rad[2]", "an angle from -3.14159 to 3.14159", "4"),
    case("joint twice", "arm", ["joints", 1, "name"], "base", "joints[1].name", "a joint name used once", "base again, after joints[0].name"),
    case("workspace inside out", "arm", ["motion", "workspace_m", 0, 1], 0.5, "motion.workspace_m[1][1]", "the lesser value first", "0.5 and 0.43"),
    case("heights order", "arm", ["motion", "heights_m"], [0.3, 0.2], "motion.heights_m", "the lesser value first", "0.3 and 0.2"),
    case("tips in the table", "arm", ["motion", "heights_m"], [0.01, 0.2], "motion.heights_m[0]", "at least 0.019", "0.01"),
    case("short leash", "arm", ["motion", "leash_m"], 0.01, "motion.leash_m", "at least max_step_m", "0.01"),
    case("hard push above limit", "arm", ["motion"], {"workspace_m": [[0, 0, 0], [1, 1, 1]], "hard_force_n": 250}, "motion.hard_force_n", "at least contact_force_n = 15 and less than force_limit_n = 250", "250"),
    case("contact above limit", "arm", ["motion"], {"workspace_m": [[0, 0, 0], [1, 1, 1]], "contact_force_n": 9, "force_limit_n": 5}, "motion.contact_force_n", "less than force_limit_n = 5", "9"),
    case("grip force", "arm", ["tool", "grip_force_n"], 500, "tool.grip_force_n", "a force from 20 to 235", "500"),
    case("force order", "arm", ["tool", "force_n"], [50, 40], "tool.force_n", "the lesser value first", "50 and 40"),
    case("fingers longer than the tool", "arm", ["tool", "finger_depth_m"], 0.2, "tool.finger_depth_m", "less than tcp_m[2]", "0.2"),
    case("pads longer than the fingers", "arm", ["tool", "pad_size_m"], [0.01, 0.02, 0.09], "tool.pad_size_m[2]", "at most finger_depth_m = 0.08", "0.09"),
    case("capsule without length", "arm", ["capsules", 0, "to_m"], [0, 0, 0], "capsules[0].to_m", "another point", "the same point"),
    case("ticks", "rig", ["physics_s"], 0.003, "physics_s", "a whole part of tick_s = 0.01", "0.003"),
    case("no step length", "learning", ["actions"], {"distance_shares": [0]}, "actions.distance_shares", "above 0", "only 0"),
    case("workspace too flat", "arm", ["motion"], {"workspace_m": [[0.24, -0.4, 0.1], [0.64, 0.4, 0.25]]}, "motion.workspace_m[1][2]", "at least 0.3, so that both heights_m", "0.25"),
    case("no literals", "learning", ["subgoal_selection", "max_literals"], 0, "subgoal_selection.max_literals", "a whole number from 1 up to 4", "0"),
    case("certain change", "learning", ["subgoal_selection", "hazard"], 1, "subgoal_selection.hazard", "a number from 0 below 1", "1"),
    case("only local changes", "learning", ["subgoal_selection", "local_change"], 1.0, "subgoal_selection.local_change", "a number from 0 below 1", "1"),
    case("impossible literals", "learning", ["subgoal_selection", "literal_cost"], 1e6, "subgoal_selection.literal_cost", "up to 20", "1000000"),
    case("headings without number", "learning", ["actions"], {"n_headings": 1_000_000}, "actions.n_headings", "a whole number from 3 up to 360", "1000000"),
    case("two headings", "learning", ["actions"], {"n_headings": 2}, "actions.n_headings", "from 3 up to 360", "2"),
    case("wishes without number", "learning", ["novelty"], {"wishes": 1_000_000}, "novelty.wishes", "from 1 up to 10000", "1000000"),
    case("learning rate", "learning", ["expert"], {"learning_rate": 10.0}, "expert.learning_rate", "up to 0.1", "10"),
    case("expectile", "learning", ["expert"], {"expectile": 1.0}, "expert.expectile", "above 0 below 1", "1"),
    case("batch", "learning", ["expert"], {"buffer_steps": 8}, "expert.batch", "at most buffer_steps = 8", "128"),
]  # fmt: skip

SCENARIOS = [
    case("name twice", "scenario", ["boxes", 0, "name"], "blue_button", "boxes[0].name", "a name used once", "after buttons[2].name"),
    case("reserved name", "scenario", ["boxes", 0, "name"], "table", "boxes[0].name", "a name other than table", "table"),
    case("goal twice", "scenario", ["goals", 1, "name"], "orange_pressed", "goals[1].name", "used once", "after goals[0].name"),
    case("input twice", "scenario", ["boxes", 1, "presence_input"], 2, "boxes[1].presence_input", "a digital input used once", "2 again, after buttons[2].input"),
    case("output twice", "scenario", ["boxes", 1, "lid", "output"], 0, "boxes[1].lid.output", "a digital output used once", "0 again, after buttons[0].lamp_output"),
    case("cylinder inside nothing", "scenario", ["cylinders", 0, "inside"], "red_bax", "cylinders[0].inside", "a box: red_box", "red_bax (did you mean red_box?)"),
    case("cylinder inside a button", "scenario", ["cylinders", 0, "inside"], "blue_button", "cylinders[0].inside", "a box", "blue_button"),
    case("receptacle", "scenario", ["cylinders", 1, "receptacle"], "bin", "cylinders[1].receptacle", "a box", "bin"),
    case("receptacle is its own box", "scenario", ["cylinders", 1, "receptacle"], "blue_box", "cylinders[1].receptacle", "another box", "blue_box"),
    case("distance", "scenario", ["distances", 2], "blu_button", "distances[2]", "an object or table", "did you mean blue_button?"),
    case("distance twice", "scenario", ["distances", 2], "table", "distances[8]", "a distance used once", "table again, after distances[2]"),
    case("goal's object", "scenario", ["goals", 3, "object"], "red_cube", "goals[3].object", "a cylinder that is no distractor", "red_cube"),
    case("goal presses a cylinder", "scenario", ["goals", 0, "object"], "red_cylinder", "goals[0].object", "a button", "red_cylinder"),
    case("goal about a distractor", "scenario", ["cylinders", 0, "is_distractor"], True, "goals[3].object", "no distractor", "red_cylinder"),
    case("goal's box", "scenario", ["goals", 5, "box"], "square_bax", "goals[5].box", "a box", "did you mean square_box?"),
    case("goal without its box", "scenario", ["goals", 5, "box"], None, "goals[5].box", "a box, since the kind is in_box", "nothing"),
    case("goal's box not opened over", "scenario", ["goals", 5, "box"], "red_box", "goals[5].box", "square_box, the receptacle", "red_box"),
    case("box for a button", "scenario", ["goals", 0, "box"], "red_box", "goals[0].box", "no box for kind pressed", "red_box"),
    case("workspace inside out", "scenario", ["workspace_m", 0, 1], 0.4, "workspace_m[1][1]", "the lesser value first", "0.4 and 0.36"),
    case("no goal at first", "scenario", ["goals", 0, "from_epoch"], 3, "goals[0].from_epoch", "0: a goal that is known from the first", "3"),
    case("a goal before the one before", "scenario", ["goals", 4, "from_epoch"], 50, "goals[5].from_epoch", "at least 50", "0"),
    case("schedule's start", "scenario", ["schedule", 0, "from_epoch"], 5, "schedule[0].from_epoch", "0, the first epoch", "5"),
    case("schedule's order", "scenario", ["schedule", 1, "from_epoch"], 0, "schedule[1].from_epoch", "an epoch after 0", "0"),
    case("schedule's rules", "scenario", ["schedule", 1, "rules"], "paper_afte", "schedule[1].rules", "paper_after", "did you mean paper_after?"),
    case("schedule's file", "scenario", ["schedule", 1, "rules"], "./none.yaml", "schedule[1].rules", "a file that can be read", "none.yaml"),
    case("overlap", "scenario", ["buttons", 1, "position_m"], [0.32, -0.2], "buttons[1].position_m", "clear of buttons[0]", "an overlap of"),
    case("overlap with a box", "scenario", ["buttons", 1, "position_m"], [0.5, 0.0], "boxes[1].position_m", "clear of buttons[1]", "an overlap of"),
    case("overlap with a spread", "scenario", ["boxes", 1, "spread_m"], [0.02, 0.1], "boxes[1].position_m", "clear of boxes[0]", "an overlap of 70 mm"),
    case("overlap on the table", "scenario", ["cylinders", 2], CYLINDER | {"position_m": [0.54, 0.0]}, "cylinders[2].position_m", "clear of boxes[1]", "an overlap of"),
    case("flat button", "scenario", ["buttons", 1, "height_m"], 0.02, "buttons[1].height_m", "at least 0.025, cap and travel", "0.02"),
    case("off the table", "scenario", ["buttons", 1, "position_m"], [0.0, 0.0], "buttons[1].position_m", "on the table", "36 mm beyond it"),
    case("outside its box", "scenario", ["cylinders", 0, "position_m"], [0.06, 0], "cylinders[0].position_m", "within red_box", "12 mm beyond"),
    case("two in one place", "scenario", ["cylinders", 2], CYLINDER | {"inside": "red_box", "position_m": [0, 0]}, "cylinders[2].position_m", "clear of cylinders[0]", "an overlap"),
    case("taller than its lidded box", "scenario", ["cylinders", 0, "height_m"], 0.08, "cylinders[0].height_m", "at most 0.073, so that the lid of red_box shuts", "0.08"),
    case("taller than its lidded receptacle", "scenario", ["boxes", 1, "height_m"], 0.06, "cylinders[1].height_m", "at most 0.058, so that the lid of square_box shuts", "0.06"),
    case("blind to a goal's object", "scenario", ["distances", 6], ..., "distances", "every object that a goal names", "none to red_cylinder"),
    case("blind to a goal's box", "scenario", ["distances", 4], ..., "distances", "every object that a goal names", "none to square_box"),
    case("blind to all but the table", "scenario", ["distances"], ["table"], "distances", "orange_button, green_button", "none to orange_button"),
    case("slow lid", "scenario", ["boxes", 0, "lid", "speed_rad_s"], 0.001, "boxes[0].lid.speed_rad_s", "a number from 0.2 up to 2", "0.001"),
    case("weak lid", "scenario", ["boxes", 0, "lid", "force_n"], 0.01, "boxes[0].lid.force_n", "a number from 0.5 up to 5", "0.01"),
    case("slippery", "scenario", ["cylinders", 0, "friction"], 1e-9, "cylinders[0].friction", "a number from 0.05 up to 3", "1e-09"),
    case("heavy", "scenario", ["cylinders", 0, "mass_kg"], 50, "cylinders[0].mass_kg", "a number from 0.01 up to 3", "50"),
    case("unreachable goal", "scenario", ["reflexes"], {"open_over_receptacle": False}, "schedule[0].rules", "every goal can be reached", "paper_before, under which blue_in_square_box cannot: what opens the lids in the way never holds, or it takes a reflex that is off (open_over_receptacle)"),
]  # fmt: skip

RULES = [
    case("contradiction", "rules", ["rules", 0, "when", 1], {"input": "green_button", "is_on": False}, "rules[0].when[1].input", "so that the rule can hold", "green_button on and off at once"),
    case("literal twice", "rules", ["rules", 0, "when", 1], {"input": "green_button", "is_on": True}, "rules[0].when[1].input", "each input once", "green_button again"),
    case("output twice", "rules", ["rules", 1, "output"], "red_box", "rules[1].output", "an output used once", "after rules[0].output"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "path", "value", "where", "expected", "got"), TYPES + ARMS + SCENARIOS + RULES)
def test_what_is_wrong_in_a_file_is_told_by_place_expected_and_got(tmp_path, kind, path, value, where, expected, got):
    name = {"arm": "ur5e", "learning": "default", "rig": "twin", "rules": "paper_before", "scenario": "paper"}[kind]
    tree = shipped_tree(FOLDERS[Kind(kind)], name)
    put(tree, path, value)
    file = write(tmp_path, "wrong.yaml", tree)
    error = refusal(LOADERS[Kind(kind)], file)
    assert error.file == str(file)
    assert error.where == where
    assert expected in error.expected
    assert got in error.got
    assert str(error).startswith(f"{file}: {where}" if where else f"{file}: expected")
    assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("path", "value", "where", "expected", "got"),
    [
        (["rules", 0, "output"], "red_bax", "rules[0].output", "a box with a lid of scenario mine", "did you mean red_box?"),
        (["rules", 0, "output"], "green_button", "rules[0].output", "a box with a lid", "green_button"),
        (["rules", 0, "when", 0, "input"], "gren_button", "rules[0].when[0].input", "gripper", "did you mean green_button?"),
        (["rules", 0, "when", 0, "input"], "blue_box", "rules[0].when[0].input", "a box with a sensor", "blue_box"),
        (["rules", 0], ..., "rules", "a rule for each lid of scenario mine", "none for red_box"),
    ],
)  # fmt: skip
def test_rules_that_do_not_fit_their_scenario_are_told_in_the_rules_file(tmp_path, path, value, where, expected, got):
    tree = shipped_tree("scenarios", "paper") | {
        "name": "mine",
        "schedule": [{"from_epoch": 0, "rules": "./mine.yaml"}],
    }
    rules = shipped_tree("rules", "paper_before")
    put(rules, path, value)
    rules_file = write(tmp_path, "mine.yaml", rules)
    load_rules(rules_file)
    error = refusal(load_scenario, write(tmp_path, "scenario.yaml", tree))
    assert error.file == str(rules_file)
    assert error.where == where
    assert expected in error.expected
    assert got in error.got


@pytest.mark.parametrize(
    ("path", "value", "where", "expected", "got"),
    [
        (["buttons", 0, "name"], "elbow", "buttons[0].name", "a name that no joint of the arm has", "elbow"),
        (["start"], {"position_m": [0.2, 0, 0.2]}, "start.position_m[0]", "within the arm's workspace", "0.2 ± 0.06"),
        (["start"], {"position_m": [0.3, 0, 0.06]}, "start.position_m[2]", "more than 0.07, so that the fingertips begin above orange_button", "0.06"),
        (["start"], {"position_m": [0.38, 0, 0.18], "spread_m": [0.01, 0.01, 0.001]}, "start.position_m[2]", "more than 0.1835, so that the fingertips begin above square_box", "0.18"),
        (["buttons", 0, "position_m"], [0.26, -0.21], "buttons[0].position_m[0]", "within the arm's workspace", "0.26 ± 0.03"),
        (["boxes", 0, "position_m"], [0.54, -0.36], "cylinders[0].position_m[1]", "within the arm's workspace", "-0.36 ± 0.05"),
        (["cylinders", 0, "diameter_m"], 0.08, "cylinders[0].diameter_m", "what the open jaws take", "0.08"),
        (["cylinders", 0, "height_m"], 0.02, "cylinders[0].height_m", "more than the tool's lowest height", "0.02"),
        (["cylinders", 0, "spread_m"], [0.02, 0.05], "cylinders[0].spread_m[1]", "the open hand finds room", "0.05"),
        (["workspace_m", 0, 2], 0.2, "workspace_m[0][2]", "0.015 to 0.025, the tool's lowest height over this table", "0.2"),
        (["workspace_m", 1, 2], 0.03, "workspace_m[1][2]", "0.225, the tool's travel height over this table, to 0.32", "0.03"),
        (["table"], {"height_m": 0.2}, "table.height_m", "-0.01 to 0.095, so that the arm reaches down", "0.2"),
        (["table"], {"height_m": -0.1}, "table.height_m", "-0.01 to 0.095", "-0.1"),
        (["boxes", 0, "height_m"], 0.15, "boxes[0].height_m", "below the fingertips at travel height", "0.2425"),
    ],
)  # fmt: skip
def test_a_scenario_that_does_not_suit_the_arm_is_refused_when_they_meet(tmp_path, path, value, where, expected, got):
    tree = shipped_tree("scenarios", "paper")
    if path == ["buttons", 0, "name"]:
        tree["goals"][0]["object"] = tree["distances"][0] = "elbow"
        tree["schedule"] = [{"from_epoch": 0, "rules": "paper_before"}]
    put(tree, path, value)
    file = write(tmp_path, "scenario.yaml", tree)
    load_scenario(file)
    error = refusal(resolve, scenario=file)
    assert error.file == str(file)
    assert error.where == where
    assert expected in error.expected
    assert got in error.got


def test_a_rig_that_expects_another_model_is_refused(tmp_path):
    tree = shipped_tree("rigs", "twin")
    tree["expected"]["model"] = "ur10e"
    error = refusal(resolve, rig=write(tmp_path, "rig.yaml", tree))
    assert (error.where, error.got) == ("expected.model", "'ur10e'")


def test_a_step_that_is_no_whole_number_of_ticks_is_refused(tmp_path):
    tree = shipped_tree("rigs", "twin") | {"tick_s": 0.012, "physics_s": 0.002}
    error = refusal(resolve, rig=write(tmp_path, "rig.yaml", tree))
    assert (error.where, error.got) == ("motion.step_s", "0.05")


def test_a_button_too_flat_for_the_arms_lowest_height_is_refused_when_they_meet(tmp_path):
    arm = shipped_tree("arms", "ur5e")
    arm["motion"] |= {"heights_m": [0.06, 0.22]}
    write(tmp_path, "arm.yaml", arm)
    error = refusal(resolve, rig=write(tmp_path, "rig.yaml", shipped_tree("rigs", "twin") | {"arm": "arm.yaml"}))
    assert (error.file, error.where) == ("scenarios/paper.yaml", "buttons[0].height_m")
    assert "so that the fingertips can press it down" in error.expected
    assert error.got == "0.05"


def test_an_arm_file_of_the_users_own_is_found_beside_the_rig(tmp_path):
    (tmp_path / "sub").mkdir()
    write(tmp_path / "sub", "mine.yaml", shipped_tree("arms", "ur5e") | {"tool_yaw_rad": 0.5})
    rig = write(tmp_path / "sub", "rig.yaml", shipped_tree("rigs", "twin") | {"arm": "mine.yaml"})
    assert resolve(rig=rig).arm.tool_yaw_rad == 0.5


@pytest.mark.parametrize(
    ("content", "expected", "got"),
    [
        (b"", "a mapping", "an empty file"),
        (b"\xff\xfe", "UTF-8 text", "the byte 0xff at 0"),
        (b"name: caf\xe9", "UTF-8 text", "the byte 0xe9 at 9"),
        (b"name: [1, 2", "YAML", "expected ',' or ']'"),
        (b"- 1", "a mapping", "a list of 1"),
        (b"hello", "a mapping", "'hello'"),
        (b"#" * 1_000_001, "at most 1000000 bytes", "more"),
    ],
    ids=["empty", "binary", "latin-1", "cut", "list", "scalar", "huge"],
)
def test_a_file_that_is_no_mapping_is_refused(tmp_path, content, expected, got):
    file = tmp_path / "scenario.yaml"
    file.write_bytes(content)
    error = refusal(load_scenario, file)
    assert error.file == str(file)
    assert expected in error.expected
    assert got in error.got


@pytest.mark.parametrize(
    ("name", "expected", "got"),
    [
        ("papr", "a path to a .yaml file or one of paper, workshop", "'papr' (did you mean paper?)"),
        ("", "one of paper, workshop", "''"),
        ("none.yaml", "a file that can be read", "no such file"),
        ("./", "a file", "a folder or a device"),
        ("/dev/zero", "a file", "a folder or a device"),
        ("a\0b.yaml", "a file that can be read", "null byte"),
        ("x" * 5000 + ".yaml", "a file that can be read", "name too long"),
    ],
)
def test_a_name_or_path_that_leads_nowhere_is_refused(tmp_path, monkeypatch, name, expected, got):
    monkeypatch.chdir(tmp_path)
    error = refusal(load_scenario, name)
    assert expected in error.expected
    assert got in error.got


def test_an_error_survives_the_way_between_processes():
    error = ConfigError("file", "where", "this", "that")
    rebuilt = copy.copy(error)  # by the same protocol
    assert str(rebuilt) == str(error) == "file: where: expected this, got that"
