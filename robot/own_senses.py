"""Perception of a rig that has none: what the arm feels of itself, and nothing of the table."""

from robot.messages import ArmState, Percept, SceneState

__all__ = ["OwnSenses"]


class OwnSenses:
    """Implements robot.station_doors.Perceives for a person who drives: the person sees the table.

    P(t) is empty: what nobody measured is not there, and is not zero.
    """

    def perceive(self, arm: ArmState, scene: SceneState | None) -> Percept:
        """Return a percept of the tool and the hand alone."""
        del scene
        return Percept(
            stamp_ns=arm.stamp_ns,
            distances_m=(),
            button_states=(),
            ages_s=(),
            valid=(),
            objects=(),
            tcp_position_m=arm.tcp_position_m,
            grip=arm.grip,
            is_in_contact=False,
        )
