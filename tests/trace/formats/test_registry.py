"""Bad files of any kind are a single error without another traceback."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from random import Random

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.trace.formats.files import MAX_LINE_BYTES
from cxbridge.trace.formats.mcap.records import MAGIC as MCAP
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.formats.transitions_text import format_transition
from tests.support import many, needs_plugin
from tests.trace.runs import family
from tests.unprivileged import unprivileged

BBLOGGER = b"\xff\xbb\xff\xbb\x00\x00\x00\x01"


def read(path: Path, content: bytes) -> int:
    path.write_bytes(content)
    return sum(1 for _ in open_run(path))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"hello\n", "not a recorded run"),
        (b"\0" * 5000, "not a recorded run"),
        (bytes(Random(1).randbytes(100_000)), "not a recorded run"),
        (b"x" * (MAX_LINE_BYTES + 10), "not a recorded run"),
        (b"MThd" + b"\0" * 50, "not a recorded run"),
        (MCAP[:7], "not a recorded run"),
        (MCAP, "damaged or cut off before the first event"),
        (MCAP + b"\xff" * 500, "damaged or cut off before the first event"),
        pytest.param(BBLOGGER, "cut off within the header", marks=needs_plugin("fawkes")),
        pytest.param(
            BBLOGGER + b"\0" * 300,
            "the header is not valid for a bblogger file",
            marks=needs_plugin("fawkes"),
        ),
        (b"goal gen1 class=", "not a recorded run"),
        (b"goal gen1 class=A sub-type=nil\nx\n", ":1: this line is not a transition"),
    ],
)
def test_bad_file_is_error_with_reason(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(CxbridgeError, match=message) as caught:
        read(tmp_path / "file", content)
    assert caught.value.exit_status == 2
    assert "before the first event" not in message or caught.value.hint


@settings(max_examples=many(200, 50))
@given(
    st.binary(max_size=400),
    st.sampled_from([b"", MCAP, BBLOGGER, b"I 01:00:00.000000 A: b\n", b"goal gen1 class=A sub-type=nil "]),
)
@example(b"", b"")
def test_any_content_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, start: bytes
) -> None:
    try:
        read(tmp_path_factory.getbasetemp() / "any", start + content)
    except CxbridgeError as error:
        assert error.file is not None or "not found" in error.message  # noqa: PT017 - most inputs raise


def test_folder_without_recordings_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_text("no bblogger file")
    with pytest.raises(TraceError, match="not a recorded run"):
        open_run(tmp_path)


def test_transitions_as_text_round_trip(tmp_path: Path) -> None:
    lines = [format_transition(event) for event in family() if isinstance(event, TRANSITION_TYPES)]
    path = tmp_path / "run"
    path.write_text("\n".join([*lines, "", "plan-action 10 goal=g"]))
    run = open_run(path)
    read_again = [format_transition(event) for event in run if isinstance(event, TRANSITION_TYPES)]
    assert read_again == lines
    assert run.notes == [f"line {len(lines) + 2}: the file ends within this line"]


@pytest.mark.parametrize("name", ["folder", "pipe", "socket", "device"])
def test_path_that_is_no_file_is_refused(tmp_path: Path, name: str) -> None:
    """The check must neither wait nor read without an end."""
    path = tmp_path / name
    if name == "folder":
        path.mkdir()
    elif name == "pipe":
        os.mkfifo(path)
    elif name == "device":
        path = Path("/dev/zero")
        if not path.exists():
            pytest.skip("no /dev/zero on this system")
    with socket.socket(socket.AF_UNIX) as listener:
        if name == "socket":
            listener.bind(str(path))
        message = "not a recorded run" if name == "folder" else "this is neither a file nor a folder"
        with pytest.raises(TraceError, match=message) as caught:
            open_run(path)
    assert caught.value.exit_status == 2


def test_unreadable_file_and_folder_are_errors(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text("I 01:00:00.000000 A: b\n")
    path.chmod(0)
    with unprivileged(), pytest.raises(TraceError, match="cannot be read: Permission denied"):
        open_run(path)
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "a.log").write_bytes(BBLOGGER)
    for mode in (0o444, 0o000):  # the folder has listable names, then not even names
        folder.chmod(mode)
        with unprivileged(), pytest.raises(TraceError, match="cannot be read: Permission denied"):
            open_run(folder)
    folder.chmod(0o755)
