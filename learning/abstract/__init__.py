"""The upper layers' science without physics: skills are chances of success."""
