"""Photographs of the twin's table with known truth, in good light and in bad."""

from sim_twin.studio.photographer import TwinPhotographer, open_studio

__all__ = ["TwinPhotographer", "open_studio"]
