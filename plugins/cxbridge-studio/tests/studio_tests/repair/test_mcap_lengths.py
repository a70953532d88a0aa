"""The repair of mcap files with wrong lengths is an error, or writes a whole file."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest

from cxbridge.errors import TraceError
from cxbridge_studio.repair.recordings import examine
from tests.trace.formats.mcap.test_damage import write_three_chunks, wrong_lengths, wrong_record_lengths


@pytest.mark.parametrize("make_damages", [wrong_lengths, wrong_record_lengths])
def test_wrong_lengths_are_repaired_or_an_error(make_damages, tmp_path: Path) -> None:
    """A record of 2^63-1 bytes ended ``trace repair`` in a traceback."""
    path, repaired = tmp_path / "run", tmp_path / "repaired"
    for damaged in make_damages(write_three_chunks(path)):
        path.write_bytes(damaged)
        with suppress(TraceError):
            damage = examine(path)
            if damage.actions:
                damage.write_copy(repaired)
                assert not examine(repaired).actions
