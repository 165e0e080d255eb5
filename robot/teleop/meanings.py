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
    "joint_speed": "a joint is as fast as it may be",
    "joint_acceleration": "a joint changes its speed no faster",
    "soft_margin": "a joint nears the end of its range, slower",
    "tcp_speed": "the tool is as fast as the profile lets it",
    "flange_speed": "the flange is as fast as the profile lets it",
    "elbow_speed": "the elbow is as fast as the profile lets it",
    "tool_cone": "the tool may tilt no further",
    "stop_ahead": "the arm could not stop clear of something for much longer, braking",
    "clearance": "the arm comes near something, slower",
    "singularity": "the arm nears a place where it loses a direction, slower",
    "no_intent": "nothing came in time, at rest",
    "percept_age": "nothing was perceived in time, at rest",
    "moved": "something was moved to where it would be in the way, at rest",
    "object_lost": "what the hand held slipped away",
}


def meaning(name: str) -> str:
    """Return what a limiter's name means; any other is a fence's, which its limits file gave it."""
    return MEANINGS.get(name, "at the fence of that name in the limits file")
