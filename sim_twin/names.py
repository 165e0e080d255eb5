"""Names in the MuJoCo model of what a scenario names: they can never meet the arm's, or one another's parts."""

__all__ = ["on_table"]


def on_table(thing: str, part: str = "") -> str:
    """Return the model's name of a thing of the scenario, or of a part of it. No name in a config file has a slash."""
    return f"table/{thing}/{part}" if part else f"table/{thing}"
