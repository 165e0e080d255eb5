"""What a viewer shows is where the arm is: read back by the mcap package alone, held to the arm's own kinematics."""

import json

import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader

from robot.kinematics import Kinematics
from robot.recording.picture import BASE, TOOL, Picture
from robot.recording.recorder import Recorder
from robot.recording.shown import EVERY_NS, Shown
from robot.recording.sink import Sink
from robot.recording.topics import LANES, SCENE, TF
from tests.support.stations import arm_state, fake_rig, percept

SEEN = percept(
    {
        thing.name: (0.4, 0.0, 0.0)
        for kind in ("buttons", "boxes", "cylinders")
        for thing in getattr(fake_rig().scenario, kind)
    },
    tcp_m=(0.4, 0.0, 0.2),
)

POSTURES = [
    (0.0, -1.57, 1.57, -1.57, -1.57, 0.0),
    (0.7, -1.1, 1.9, -2.3, -1.5, 0.4),
    (-1.3, -2.0, 2.2, -1.7, 1.2, 3.0),
    (3.1, -0.4, -1.1, 0.2, 0.9, -2.0),
]


def matrix(transform):
    """Return a viewer's transform as 4 × 4, from its own numbers alone."""
    q, t = transform["rotation"], transform["translation"]
    x, y, z, w = q["x"], q["y"], q["z"], q["w"]
    assert x * x + y * y + z * z + w * w == pytest.approx(1.0, abs=1e-12)
    rotation = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = rotation, (t["x"], t["y"], t["z"])
    return found


def chained(transforms, frame):
    """Return a frame in the base's, by walking up to it as a viewer does."""
    by_child = {t["child_frame_id"]: t for t in transforms}
    found = np.eye(4)
    while frame != BASE:
        found = matrix(by_child[frame]) @ found
        frame = by_child[frame]["parent_frame_id"]
    return found


def denavit_hartenberg(arm, q_rad):
    """Return the tool in the base's frame, as the textbook has it: turn, lift, shift, twist, a joint at a time."""
    found = np.eye(4)
    for joint, q in zip(arm.joints, q_rad, strict=True):
        c, s, ca, sa = np.cos(q), np.sin(q), np.cos(joint.alpha_rad), np.sin(joint.alpha_rad)
        found = found @ np.array([
            [c, -s * ca, s * sa, joint.a_m * c],
            [s, c * ca, -c * sa, joint.a_m * s],
            [0.0, sa, ca, joint.d_m],
            [0.0, 0.0, 0.0, 1.0],
        ])  # fmt: skip
    tool = np.eye(4)
    tool[:3, 3] = arm.tool.tcp_m
    return found @ tool


def messages(path, topic):
    with path.open("rb") as opened:
        return [
            (schema, json.loads(message.data))
            for schema, _, message in make_reader(opened).iter_messages(topics=[topic.name])
        ]


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    path = tmp_path_factory.mktemp("shown") / "shown.mcap"
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES)
    rig = fake_rig()
    seen = msgspec.structs.replace(SEEN, button_states=(0.0,) * len(rig.scenario.buttons))
    view = Shown(recorder, Picture(rig.arm, rig.scenario))
    for n, q in enumerate(POSTURES):
        view.perceived(seen, arm_state(q, stamp_ns=n), log_ns=n * EVERY_NS)
        view.perceived(seen, arm_state(q, stamp_ns=n), log_ns=n * EVERY_NS + EVERY_NS // 2)
    recorder.close()
    return path


@pytest.mark.parametrize("n", range(len(POSTURES)))
def test_the_tool_that_a_viewer_shows_is_where_forward_kinematics_puts_it(shown, n):
    schema, told = messages(shown, TF)[n]
    arm, found = fake_rig().arm, chained(told["transforms"], TOOL)
    assert schema.name == "foxglove.FrameTransforms"
    assert np.allclose(found[:3, 3], Kinematics(arm).tcp(POSTURES[n]), atol=1e-9)
    assert np.allclose(found, denavit_hartenberg(arm, POSTURES[n]), atol=1e-9)


def test_frames_are_told_no_more_often_than_a_viewer_needs(shown):
    assert len(messages(shown, TF)) == len(POSTURES)


def test_every_shape_hangs_on_a_frame_that_is_told(shown):
    _, told = messages(shown, TF)[0]
    ((schema, scene),) = messages(shown, SCENE)
    frames = {BASE} | {t["child_frame_id"] for t in told["transforms"]}
    assert schema.name == "foxglove.SceneUpdate"
    assert {entity["frame_id"] for entity in scene["entities"]} <= frames
    assert {f"arm/{link}" for link in range(1, 7)} & {entity["id"] for entity in scene["entities"]}
