"""The doors to a world and what stands behind them."""
