"""How skills ended in recorded runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.errors import TraceError
from cxbridge.events import Event, InterfaceWrite
from cxbridge.run.skill_history import read_samples
from cxbridge.skiller.simulation.recorded import Sample
from cxbridge.skiller.status import Status
from cxbridge.trace.formats.mcap.writer import McapWriter
from tests.support import SHARED, needs_shared


def write(path: Path, *events: Event) -> Path:
    with McapWriter(path) as writer:
        for event in events:
            writer.write(event)
    return path


def write_of(ms: int, status: str, text: str, msgid: int = 1, error: str = "") -> InterfaceWrite:
    values: dict[str, Any] = {
        "skill_string": text,
        "error": error,
        "exclusive_controller": "",
        "msgid": msgid,
        "status": status,
    }
    return InterfaceWrite(ms * 1000, "SkillerInterface::Skiller", values)


def test_only_finished_calls_are_samples(tmp_path: Path):
    run = write(
        tmp_path / "run.mcap",
        write_of(0, "S_INACTIVE", "", 0),
        write_of(1000, "S_RUNNING", "a{}", 1),
        write_of(2500, "S_FINAL", "a{}", 1),
        write_of(3000, "S_RUNNING", "stopped{}", 2),
        write_of(3100, "S_INACTIVE", "", 0),
        write_of(4000, "S_RUNNING", "replaced{}", 3),
        write_of(4100, "S_RUNNING", "b{}", 4),
        write_of(4600, "S_FAILED", "b{}", 4, "broken"),
        write_of(4600, "S_INACTIVE", "b{}", 4, "broken"),
        write_of(5000, "S_RUNNING", "a{}", 1),  # another client begins at 1, too
        write_of(5000, "S_FINAL", "a{}", 1),
        write_of(6000, "S_RUNNING", "back{}", 6),
        write_of(5900, "S_FINAL", "back{}", 6),  # the clock was set meanwhile
        write_of(6000, "S_RUNNING", "cut off{}", 5),
    )
    assert read_samples(run) == [
        Sample("a{}", 1.5),
        Sample("b{}", 0.5, Status.S_FAILED, "broken"),
        Sample("a{}", 0.0),
        Sample("back{}", 0.0),
    ]


def test_format_without_times_is_refused(tmp_path: Path):
    path = tmp_path / "run.txt"
    path.write_text('SkillerInterface skill="say{}" msgid=2 status=S_RUNNING\n')
    with pytest.raises(TraceError, match="has no times"):
        read_samples(path)


@needs_shared
@pytest.mark.parametrize("recording", ["bblogger", "bblogger-repaired", "fawkes.log"])
def test_recordings_of_fawkes(recording: str):
    samples = read_samples(SHARED / "traces" / "test-scenario" / "skiller-1" / recording)
    texts = ["Hello peggy", "Good bye", "Hello again peggy", "Cleaning up"]
    assert [sample.skill_string for sample in samples] == [
        f'say{{text="{text}", wait=true}}' for text in texts
    ]
    assert all(0.8 < sample.seconds < 1.7 and sample.status is Status.S_FINAL for sample in samples)
