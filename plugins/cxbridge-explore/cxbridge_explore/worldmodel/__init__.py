"""What can happen in the world of a run, as a ``world.yaml`` says: its model, reader and checks."""
