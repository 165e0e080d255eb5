"""The report of a check in shadow: a check's own, and what was seen of the arm that nothing was sent to."""

import msgspec
from rich.console import RenderableType
from rich.markup import escape

from robot.messages import Vec6
from sim_twin.checking.report import CheckReport, shown

__all__ = ["ShadowReport", "WatchedArm", "shown_shadow"]


class WatchedArm(msgspec.Struct, frozen=True, kw_only=True):
    """The arm that was only looked at."""

    kind: str
    model: str
    serial: str
    address: str
    q_rad: Vec6
    """Where it stood, and shadows began."""
    mode: str
    n_looks: int
    watched_s: float
    moved_rad: float
    """Farthest that a joint was seen from there."""
    tool_off_m: float
    """How far its own kinematics bring the tool from where its file does."""
    is_table_perceived: bool
    """Shadows' tables were laid out as the rig perceived its own; else drawn anew for each stream."""


class ShadowReport(CheckReport, frozen=True, kw_only=True):
    """What a check in shadow found."""

    is_shadow: bool
    """Streams ended at a shadow's gate: no client was opened that could move the arm, or write to it."""
    arm: WatchedArm

    @property
    def about(self) -> str:
        """What it is a report of, in one line."""
        arm = self.arm
        return f"SHADOW of the {arm.kind} arm {arm.model} {arm.serial} at {arm.address}, which was sent nothing"


def shown_shadow(report: ShadowReport) -> tuple[RenderableType, ...]:
    """Return the check's own table with what it is a table of, and what was seen of the arm."""
    arm, worst = report.arm, report.limits[0] if report.limits else None
    joints = ", ".join(f"{q:.3f}" for q in arm.q_rad)
    table = "laid out as perceived" if arm.is_table_perceived else "drawn anew for each stream: nobody perceives it"
    told = [
        f"{report.about}.",
        f"It was watched for {arm.watched_s:.0f} s, {arm.n_looks} times, in mode {arm.mode}, and moved by "
        f"{1e3 * arm.moved_rad:.3f} mrad at most; no program ran, nobody armed it.",
        f"Shadows began at its joints ({joints}) rad, the hand open and empty, their table {table}.",
        f"Its own kinematics bring the tool {1e3 * arm.tool_off_m:.2f} mm from where its file does.",
    ]
    if worst is not None:
        servo = ", which the physics' own servo adds" if worst.worst_margin_share < 0.0 and not worst.violations else ""
        told.append(f"Worst margin: {worst.limit} {worst.worst_margin_share:+.1%}{servo}, stream {worst.stream}.")
    return (*shown(report), *(escape(line) for line in told))
