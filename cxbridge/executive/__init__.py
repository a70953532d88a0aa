"""The executive: CLIPS environments as Fawkes makes them, their features, and the CLIPS Executive on top."""
