"""The supervisor of a rig's processes."""
