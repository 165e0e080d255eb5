"""The twin fitted to sessions: what of an arm's servos, friction, payload and lengths they show, and how surely."""
