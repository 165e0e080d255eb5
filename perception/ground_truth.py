"""The percept of a world that tells the truth: no noise, no age."""

import math

from config.arm import ArmConfig
from config.rig import Rig
from config.scenario import Scenario
from robot.errors import RobotConfigError
from robot.messages import ArmState, ObjectPercept, Percept, SceneState

__all__ = ["GroundTruthPerception"]

TABLE = "table"


class GroundTruthPerception:
    """P(t) from the poses that a simulated world gives away.

    d_j is the Euclidean distance from the tool centre point to the reference point of the j-th distance entry: the pose
    of that thing in the scene; for the table, the height over it. s_i is the read-back of button i's lamp.
    """

    def __init__(self, *, scenario: Scenario, arm: ArmConfig, rig: Rig | None = None) -> None:
        del arm, rig  # every perception is made from the same files; this one needs no tool and no camera
        self._distances = scenario.distances
        self._table_m = scenario.table.height_m
        self._lamp_bits = tuple(1 << button.lamp_output for button in scenario.buttons)
        n = len(scenario.distances) + len(scenario.buttons)
        self._ages_s, self._valid = (0.0,) * n, (True,) * n
        self._names: tuple[str, ...] = ()
        self._places: tuple[int, ...] = ()

    def perceive(self, arm: ArmState, scene: SceneState | None) -> Percept:
        """Return P(t), object poses and grip at the arm's stamp.

        Raises:
            RobotConfigError: the plant has no ground truth, or lacks a thing that a distance is measured to.
        """
        if scene is None:
            raise RobotConfigError("ground-truth perception needs a plant with ground truth: choose another perception")
        things = scene.objects
        if len(things) != len(self._names):
            self._locate(scene)
        tcp = arm.tcp_position_m
        height = abs(tcp[2] - self._table_m)
        outputs = arm.digital_out
        return Percept(
            stamp_ns=arm.stamp_ns,
            distances_m=tuple([math.dist(tcp, things[i].position_m) if i >= 0 else height for i in self._places]),
            button_states=tuple([1.0 if outputs & bit else 0.0 for bit in self._lamp_bits]),
            ages_s=self._ages_s,
            valid=self._valid,
            objects=tuple(
                [
                    ObjectPercept(name=t.name, position_m=t.position_m, quat=t.quat, age_s=0.0, is_valid=True)
                    for t in things
                ]
            ),
            tcp_position_m=tcp,
            grip=arm.grip,
            is_in_contact=False,
        )

    def _locate(self, scene: SceneState) -> None:
        """Find each distance entry in the scene; the table, which has no pose, is -1."""
        names = tuple(thing.name for thing in scene.objects)
        missing = [name for name in self._distances if name != TABLE and name not in names]
        if missing:
            raise RobotConfigError(f"the scene lacks {', '.join(missing)}, which distances are measured to")
        self._places = tuple(-1 if name == TABLE else names.index(name) for name in self._distances)
        self._names = names
