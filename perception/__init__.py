"""Measurements to percept."""
