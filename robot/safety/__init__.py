"""The last gate before the arm: passes or refuses, and latches."""
