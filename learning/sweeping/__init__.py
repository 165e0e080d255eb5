"""Many runs as one job: cells, who runs them, and what they come to together."""
