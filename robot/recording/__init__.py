"""Sessions: what a run said and did, in one MCAP file; recorded, read, checked, recovered, replayed."""

__all__: list[str] = []
