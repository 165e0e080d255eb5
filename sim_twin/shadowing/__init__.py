"""A twin beside a plant, on the same commands: how far the two are apart, what that looks like, when it is enough."""
