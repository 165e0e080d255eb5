"""The twin fitted to sessions of an arm: what of its servos, friction, payload and lengths they show, and how surely."""
