"""What the limiters' names mean, for a person at the stick. One table; docs/teleop.md prints the same."""

__all__ = ["MEANINGS", "meaning"]

MEANINGS = {
    "max_step": "asked for more than one step may move",
    "height": "below the lowest or above the travel height",
    "guard": "near the table, slower",
    "workspace": "at the edge of the workspace",
    "leash": "the arm trails what was asked, wait for it",
    "tool_down": "the tool keeps pointing down",
    "contact": "something pushes against the tool",
    "hand": "waits for the fingers",
    "brake": "the path could not be planned, braking",
    "unreachable": "no joints lead there",
    "joint_range": "a joint is at the end of its range",
    "table": "the fingertips are as low over the table as they may be",
    "no_intent": "nothing came in time, at rest",
    "object_lost": "what the hand held slipped away",
}


def meaning(name: str) -> str:
    """Return what a limiter's name means; of one that is not in the table, its own name in words."""
    return MEANINGS.get(name, name.replace("_", " "))
