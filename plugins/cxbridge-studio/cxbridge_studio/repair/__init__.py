"""Repair of recorded runs: :mod:`.recordings` for all formats, :mod:`.mcap` for the records of mcap files."""
