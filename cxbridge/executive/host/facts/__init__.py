"""Facts of an environment: creation, copies, edits and modification."""
