"""A person's reset in lock-step: parked, let go of, checked against the drawing, and on to the drawn start."""

import math
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from config.loader import resolve
from perception.ground_truth import GroundTruthPerception
from robot.errors import NotEngagedError, SafetyError
from robot.layout import draw_layout
from robot.messages import Heading, ObjectPose, SceneState
from robot.person_reset import PersonResetter, misplaced, unseen_under_lids
from robot.person_station import SLOW_M_S, SLOW_RAD_S, PersonResetStation
from robot.rigs import build_plant
from robot.tick_loop import TickLoop

SEED, EPOCH = 7, 0
SCENARIO = resolve().scenario


class ScriptedPerson:
    """Does nothing at the first key; at the second lays the table out, and touches no arm."""

    def __init__(self, plant, home_rad):
        self.plant, self.home_rad = plant, np.array(home_rad)
        self.asked, self.told, self.away_rad, self.confirmed = [], [], [], []
        self.at_key, self.seed = lambda n: None, SEED

    def tell(self, text):
        self.told.append(text)

    def await_key(self, text):
        self.asked.append(text)
        if len(self.asked) == 1:
            self.away_rad.append(np.abs(np.array(self.plant.arm.read().q_rad) - self.home_rad).max())
        if len(self.asked) == 2:
            self.lay_out(self.seed)
        self.at_key(len(self.asked))

    def confirm(self, text):
        self.await_key(text)
        self.confirmed.append(text)

    def lay_out(self, seed):
        world = self.plant.world
        layout = draw_layout(SCENARIO, np.random.default_rng([seed, EPOCH]))
        world.put(layout, world.data.qpos[:6].tolist(), self.plant.arm.read().digital_out)


@pytest.fixture
def lab(tmp_path):
    resolved = resolve()
    plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)
    loop = TickLoop(
        arm=plant.arm,
        config=resolved.arm,
        scenario=resolved.scenario,
        rule_sets=resolved.rule_sets,
        rig=resolved.rig,
        profile=resolved.profile,
    )
    person = ScriptedPerson(plant, resolved.arm.home_rad)
    resetter = PersonResetter(
        scenario=resolved.scenario, loop=loop, scene=plant.truth, person=person, pictures=tmp_path
    )
    station = PersonResetStation(
        world=SimpleNamespace(identity=plant.identity, truth=plant.truth, resetter=resetter), loop=loop,
        perception=GroundTruthPerception(scenario=resolved.scenario, arm=resolved.arm), arm=resolved.arm,
        scenario=resolved.scenario, rig=resolved.rig,
    )  # fmt: skip
    station.prepare(resetter, resolved.arm.home_rad)
    with station:
        yield station, resetter, person, tmp_path


def test_a_reset_parks_asks_until_all_is_in_place_and_goes_to_the_drawn_start(lab):
    station, resetter, person, folder = lab
    with pytest.raises(NotEngagedError):
        station.reset(seed=SEED, epoch=EPOCH)
    assert person.asked == []
    station.arm(by="the test")
    station.engage()
    for _ in range(20):
        station.step(Heading(heading_rad=-2.0, distance_m=0.02, height_m=0.1))
    percept = station.reset(seed=SEED, epoch=EPOCH)
    assert person.away_rad[0] < 0.02
    assert len(person.asked) == 3
    assert any("red_cylinder" in line and "mm off" in line for line in person.told)
    start_m = resetter.layout_of(seed=SEED, epoch=EPOCH).start_m
    assert np.linalg.norm(np.subtract(percept.tcp_position_m, start_m)) < 0.005
    (picture,) = folder.glob("*.png")
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_a_thing_is_in_place_within_ten_millimetres(lab):
    _, resetter, person, _ = lab
    layout = resetter.layout_of(seed=SEED, epoch=EPOCH)
    person.plant.resetter.reset(seed=SEED, epoch=EPOCH, digital_out=0)
    scene = person.plant.truth.read()
    assert misplaced(layout, scene, SCENARIO) == []
    for away_m, n_off in ((0.0095, 0), (0.0105, 1)):
        x, y = layout.fixtures_m["green_button"]
        shifted = layout.fixtures_m | {"green_button": (x + away_m, y)}
        moved = type(layout)(fixtures_m=shifted, cylinders=layout.cylinders, start_m=layout.start_m)
        assert len(misplaced(moved, scene, SCENARIO)) == n_off
    assert "orange_button: not perceived" in misplaced(layout, without(scene, "orange_button"), SCENARIO)[0]


def without(scene, *names):
    return type(scene)(stamp_ns=0, objects=tuple(thing for thing in scene.objects if thing.name not in names))


def test_what_a_lid_hides_is_taken_on_a_persons_word_and_nothing_else_is(lab):
    _, resetter, person, _ = lab
    layout = resetter.layout_of(seed=SEED, epoch=EPOCH)
    person.plant.resetter.reset(seed=SEED, epoch=EPOCH, digital_out=0)
    scene = person.plant.truth.read()
    assert unseen_under_lids(scene, SCENARIO) == {}
    hidden = without(scene, "red_cylinder")
    assert misplaced(layout, hidden, SCENARIO) == []
    assert unseen_under_lids(hidden, SCENARIO) == {"red_cylinder": "red_box"}
    open_topped = [msgspec.structs.replace(box, lid=None) for box in SCENARIO.boxes]
    no_lids = msgspec.structs.replace(SCENARIO, boxes=tuple(open_topped))
    assert unseen_under_lids(hidden, no_lids) == {}
    assert "red_cylinder: not perceived" in misplaced(layout, hidden, no_lids)[0]


def test_what_nobody_can_see_is_named_to_the_person(lab):
    station, resetter, person, _ = lab
    station.arm(by="the test")
    station.engage()
    read = resetter._scene.read
    resetter._scene = SimpleNamespace(read=lambda: without(read(), "blue_cylinder"))
    station.reset(seed=SEED, epoch=EPOCH)
    assert "blue_cylinder is taken on your word to be in blue_box" in person.asked[-1]


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda p, q: (p, (math.cos(math.pi / 4), math.sin(math.pi / 4), 0.0, 0.0)), "must stand"),
        (lambda p, q: ((p[0], p[1], p[2] + 0.3), q), "in height"),
        (lambda p, q: ((p[0], p[1], p[2] + 0.019), q), ""),
    ],
)
def test_a_cylinder_that_lies_or_stands_on_something_is_not_in_place(lab, change, word):
    _, resetter, person, _ = lab
    layout = resetter.layout_of(seed=SEED, epoch=EPOCH)
    person.plant.resetter.reset(seed=SEED, epoch=EPOCH, digital_out=0)
    scene = person.plant.truth.read()
    changed = []
    for thing in scene.objects:
        place, turn = thing.position_m, thing.quat
        if thing.name == "red_cylinder":
            place, turn = change(place, turn)
        changed.append(ObjectPose(name=thing.name, position_m=place, quat=turn))
    off = misplaced(layout, SceneState(stamp_ns=0, objects=tuple(changed)), SCENARIO)
    assert [word in line and "red_cylinder" in line for line in off] == ([True] if word else [])


def test_what_is_moved_after_it_was_in_place_is_seen_before_the_arm_moves(lab):
    station, _, person, _ = lab
    station.arm(by="the test")
    station.engage()

    def meddle(n):
        if n in (3, 5):  # 3: "hands off"; then he is asked to put it right, and again
            person.plant.resetter.reset(seed=SEED + (n == 3), epoch=EPOCH, digital_out=0)
        elif n == 4:
            person.plant.resetter.reset(seed=SEED, epoch=EPOCH, digital_out=0)

    person.at_key = meddle
    station.reset(seed=SEED, epoch=EPOCH)
    assert ["hands off" in text for text in person.asked] == [False, False, True, False, True]


def test_hands_are_off_the_table_only_when_it_is_confirmed(lab):
    station, resetter, person, _ = lab
    resetter.reset(seed=SEED, epoch=EPOCH, digital_out=0)
    assert ["hands off" in text for text in person.asked] == [False, False, True]
    assert person.confirmed == person.asked[-1:]
    station.arm(by="the test")
    station.engage()
    person.asked.clear()
    held_rad = []
    person.confirm = lambda text: held_rad.append(person.plant.arm.read().q_rad) or stop_asking()
    with pytest.raises(SafetyError, match="nobody"):
        station.reset(seed=SEED, epoch=EPOCH)
    assert held_rad == [person.plant.arm.read().q_rad]


def test_a_stop_that_nobody_confirmed_is_not_called_disarmed(lab, monkeypatch):
    _, resetter, person, _ = lab
    resetter.reset(seed=SEED, epoch=EPOCH, digital_out=0)
    assert person.asked[0].startswith("the arm is disarmed")
    monkeypatch.setattr(TickLoop, "why_lost", property(lambda self: "stop: nobody confirms it"))
    person.asked.clear()
    resetter.reset(seed=SEED, epoch=EPOCH, digital_out=0)
    assert person.asked[0].startswith("NOT CONFIRMED that nothing runs on the arm (stop: nobody confirms it)")


@pytest.mark.parametrize("seed", [3, 8])
def test_on_its_way_from_and_to_a_person_the_arm_is_slow(lab, seed):
    station, _, person, _ = lab
    station.arm(by="the test")
    station.engage()
    for _ in range(20):
        station.step(Heading(heading_rad=-2.0, distance_m=0.02, height_m=0.05))
    station._come_to_rest()
    person.seed, speeds, tick = seed, [], person.plant.world.clock.wait_tick

    def watched():
        tick()
        state = person.plant.arm.read()
        speeds.append((max(map(abs, state.qd_rad_s)), math.hypot(*state.tcp_speed_m_s)))

    person.plant.world.clock.wait_tick = watched
    station.reset(seed=seed, epoch=EPOCH)
    fastest_rad_s, fastest_m_s = map(max, zip(*speeds, strict=True))
    assert SLOW_RAD_S < fastest_rad_s < 0.5
    assert SLOW_M_S < fastest_m_s < 0.15


def test_before_a_person_is_asked_the_arm_is_stopped_and_its_rest_awaited(tmp_path):
    said = []
    loop = SimpleNamespace(stop=lambda: said.append("stop"), await_rest=lambda: said.append("rest"), why_lost=None)
    person = SimpleNamespace(tell=said.append, await_key=lambda text: said.append(text) or stop_asking())
    scene = SimpleNamespace(read=lambda: said.append("look"))
    resetter = PersonResetter(scenario=SCENARIO, loop=loop, scene=scene, person=person, pictures=tmp_path)
    with pytest.raises(SafetyError, match="nobody"):
        resetter.reset(seed=SEED, epoch=EPOCH, digital_out=0)
    assert said[:2] == ["stop", "rest"]
    assert len(said) == 3


def stop_asking():
    raise SafetyError("nobody is at the arm")


def test_a_start_that_is_drawn_higher_than_intents_may_ask_for_is_gone_to_as_high_as_they_may(lab):
    station, resetter, person, _ = lab
    station.arm(by="the test")
    station.engage()
    seed = next(s for s in range(100) if resetter.layout_of(seed=s, epoch=EPOCH).start_m[2] > top_m(station) + 0.003)
    person.seed = seed
    percept = station.reset(seed=seed, epoch=EPOCH)
    x, y, _ = resetter.layout_of(seed=seed, epoch=EPOCH).start_m
    assert np.linalg.norm(np.subtract(percept.tcp_position_m, (x, y, top_m(station)))) < 0.005


def top_m(station):
    return station.spec.table_height_m + station.spec.heights_m[1]
