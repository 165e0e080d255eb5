"""Motion of the virtual controller: set-points 500 times a second, and the twin that follows them."""
