"""Data and its schema: YAML files become frozen, typed Structs. Imports nothing of ours."""
