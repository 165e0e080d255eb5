"""The virtual controller: what a Universal Robots controller shows to its clients."""
