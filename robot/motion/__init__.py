"""From an intent to jerk-limited joint targets."""
