"""What Foxglove's panels show of a run: one mapping for recordings and live; see docs/see.md#foxglove."""
