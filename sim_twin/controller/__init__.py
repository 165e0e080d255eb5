"""A virtual UR controller in front of the twin: clients of UR's interfaces connect to it unmodified."""
