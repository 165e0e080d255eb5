"""Everything that touches time, wires or motors; knows nothing of goals."""
