"""A virtual UR controller: what UR's interfaces say and obey, in front of the twin."""
