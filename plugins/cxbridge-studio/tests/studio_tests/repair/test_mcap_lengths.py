"""Mcap files with wrong lengths: the repair ends with our errors or none, and what it writes is whole."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest

from cxbridge.errors import TraceError
from cxbridge_studio.repair.recordings import examine
from tests.trace.formats.mcap.test_damage import write_three_chunks, wrong_lengths, wrong_record_lengths


@pytest.mark.parametrize("damages", [wrong_lengths, wrong_record_lengths])
def test_no_length_in_a_file_is_believed(damages, tmp_path: Path) -> None:
    """A record of 2^63-1 bytes ended ``trace repair`` in a traceback."""
    path, repaired = tmp_path / "run", tmp_path / "repaired"
    for damaged in damages(write_three_chunks(path)):
        path.write_bytes(damaged)
        with suppress(TraceError):
            damage = examine(path)
            if damage.actions:
                damage.write_copy(repaired)
                assert not examine(repaired).actions
