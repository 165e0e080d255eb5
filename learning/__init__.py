"""Percept to decision: goals, sub-goals, experts."""
