"""The simulated world: one table, one arm, contact physics."""
