"""The possible events of a run as described by ``world.yaml``: model, reader and checks."""
