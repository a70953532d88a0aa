"""Messages for Foxglove's panels, in recordings and live; see docs/see.md#foxglove."""
