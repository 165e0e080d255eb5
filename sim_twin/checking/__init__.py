"""`teleop check` on the twin: streams against a rig, judged by an independent monitor."""

from sim_twin.checking.command import check_rig
from sim_twin.checking.ring import Ring, StreamResult

__all__ = ["Ring", "StreamResult", "check_rig"]
