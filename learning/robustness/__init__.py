"""What a run bears: its newest checkpoint on a twin that is not the one it learnt on, and what it learns there."""
