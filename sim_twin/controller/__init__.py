"""A virtual Universal Robots controller: its wires, its script language and its states."""
