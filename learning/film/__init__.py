"""A minute of a run, for people: how it learnt, what a change of rules did, how it recovered."""
