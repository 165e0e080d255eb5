"""A drawn table as a picture: a view from above in the base frame, for whoever lays the table out."""

from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from config.scenario import Scenario
from robot.layout import Layout

__all__ = ["draw_picture"]

MM = 1e3
SIZE_IN, DPI = (8.0, 9.0), 110


def draw_picture(scenario: Scenario, layout: Layout, title: str, path: Path) -> None:
    """Write a PNG: buttons, boxes and cylinders where they belong, each with its place in mm of the base frame.

    Args:
        scenario: sizes and colours.
        layout: what was drawn.
        title: over the picture.
        path: of the file; its folder is made.
    """
    figure = Figure(figsize=SIZE_IN, dpi=DPI)
    axes = figure.add_subplot()
    for box in scenario.boxes:
        x, y = layout.fixtures_m[box.name]
        width, depth = (inner + 2 * box.wall_m for inner in box.inner_m)
        corner = ((y - depth / 2) * MM, (x - width / 2) * MM)
        axes.add_patch(Rectangle(corner, depth * MM, width * MM, fill=False, ec=box.colour, lw=4))
        _label(axes, box.name, (x - width / 2 - 0.024, y), (x, y))
    for button in scenario.buttons:
        x, y = layout.fixtures_m[button.name]
        axes.add_patch(Circle((y * MM, x * MM), button.diameter_m / 2 * MM, fc=button.colour, ec="black"))
        _label(axes, button.name, (x - button.diameter_m / 2 - 0.024, y), (x, y))
    for cylinder in scenario.cylinders:
        x, y = layout.cylinders[cylinder.name].position_m
        axes.add_patch(
            Circle((y * MM, x * MM), cylinder.diameter_m / 2 * MM, fc=cylinder.colour, ec="black", hatch="//")
        )
        _label(axes, cylinder.name, (x + cylinder.diameter_m / 2 + 0.024, y), (x, y))
    axes.plot([0.0], [0.0], "k^", markersize=14)
    axes.annotate("robot base", (0.0, 0.0), xytext=(12, 4), textcoords="offset points")
    axes.set(
        xlabel="y (mm), to the left of the robot", ylabel="x (mm), ahead of the robot", title=title, aspect="equal"
    )
    axes.autoscale_view()
    axes.invert_xaxis()
    axes.grid(visible=True, alpha=0.3)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)


def _label(axes, name: str, at_m: tuple[float, float], place_m: tuple[float, float]) -> None:  # noqa: ANN001
    x, y = place_m
    axes.text(at_m[1] * MM, at_m[0] * MM, f"{name}\n{x * MM:.0f}, {y * MM:.0f}", ha="center", va="center", fontsize=8)
