"""Messages for Foxglove's panels, both in recordings and live; see docs/see.md#foxglove."""
