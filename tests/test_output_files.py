"""Files that commands write are whole or unchanged: one helper, and a list of modules without the helper."""

from __future__ import annotations

import ast
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import Event, InterfaceWrite, Level, LogLine
from cxbridge.file_access import replaced_file, write_file
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.files import open_exclusively
from cxbridge.trace.formats.registry import copy_formats
from tests.support import module_files, short_path
from tests.trace.runs import MemoryRun, family

WITHOUT_HELPER = {
    "cxbridge_planning/fawkes/plugins.py": "files for a planner that the agent names, beside each other",
    "cxbridge_explore/game/scenario.py": "a temporary file",
    "cxbridge_planning/engines/command.py": "temporary files",
    "cxbridge_planning/engines/unified.py": "a temporary file, in one piece",
    "cxbridge_ros2cx/cx/log_files.py": "logs of environments, whole as far as they go",
    "cxbridge_fawkes/csv/writer.py": "called with a path of the helper",
    "cxbridge_studio/repair/mcap.py": "called with a path of the helper",
    "cxbridge_fawkes/bblogger/writer.py": "a recording, whole after each entry",
    "trace/formats/files.py": "recordings, whole as far as they go",
    "trace/formats/transitions_text.py": "called with a path of the helper",
    "trace/sources.py": "refuses files that are there",
}
"""Why a module opens files for writing by itself."""


def writes(file: Path) -> bool:
    """Whether a module opens files for writing that are not paths of the helper."""
    nodes = list(ast.walk(ast.parse(file.read_text())))
    new_files = {
        item.optional_vars.id
        for node in nodes
        if isinstance(node, ast.With)
        for item in node.items
        if isinstance(item.context_expr, ast.Call)
        and getattr(item.context_expr.func, "id", "") == "replaced_file"
        and isinstance(item.optional_vars, ast.Name)
    }
    for call in (node for node in nodes if isinstance(node, ast.Call)):
        if isinstance(call.func, ast.Attribute) and getattr(call.func.value, "id", "") in new_files:
            continue
        name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
        modes = [argument.value for argument in call.args if isinstance(argument, ast.Constant)]
        opens = any(isinstance(mode, str) and mode[:1] in ("w", "x") and len(mode) <= 2 for mode in modes)
        if name in ("write_text", "write_bytes") or (name == "open" and opens):
            return True
    return False


def test_modules_that_write_files_without_helper():
    found = {short_path(file) for file in module_files().values() if writes(file)}
    assert found == set(WITHOUT_HELPER)


class BrokenRun(MemoryRun):
    """A run of a goal's family and two interfaces that breaks before its end."""

    def __iter__(self) -> Iterator[Event]:
        """Yield the events and fail."""
        yield from super().__iter__()
        raise TraceError("cannot be read any more")


def events(*uids: str) -> list[Event]:
    written = [InterfaceWrite(time_us=1, uid=uid, values={"x": 1.0}) for uid in uids]
    return [*family(), LogLine(time_us=1, level=Level.INFO, component="c", text="t"), *written]


def tree(folder: Path) -> dict[str, bytes]:
    """Return the paths in a folder, files with their contents."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else b""
        for path in sorted(folder.rglob("*"))
    }


@pytest.mark.parametrize("name", ["out", "out.csv"])
@pytest.mark.parametrize("there", ["nothing", "file", "folder"])
@pytest.mark.parametrize("to", copy_formats())
def test_failed_conversion_keeps_existing_output(to: str, there: str, name: str, tmp_path: Path):
    output = tmp_path / name
    if there == "file":
        output.write_text("something else")
    elif there == "folder":
        output.mkdir()
        (output / "other").write_text("something else")
    before = tree(tmp_path)
    with pytest.raises(CxbridgeError) as caught:
        convert(BrokenRun(events("Position3DInterface::a", "Position3DInterface::b")), output, to)
    assert tree(tmp_path) == before
    assert ".cxbridge-" not in str(caught.value)


def test_locked_recording_is_not_replaced(tmp_path: Path):
    output = tmp_path / "out.mcap"
    with open_exclusively(output) as file:
        with pytest.raises(TraceError, match="another process is writing"):
            convert(MemoryRun(events()), output, "mcap")
        file.write(b"its own")
    assert output.read_bytes() == b"its own"


def test_link_points_to_new_file(tmp_path: Path):
    (tmp_path / "folder").mkdir()
    link = tmp_path / "link"
    link.symlink_to("folder/file")
    write_file(link, "one")
    write_file(link, "two")
    assert link.is_symlink()
    assert tree(tmp_path) == {"folder": b"", "folder/file": b"two", "link": b"two"}


def test_pipe_is_written(tmp_path: Path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_file(pipe, "text")
        assert os.read(reader, 9) == b"text"
    finally:
        os.close(reader)


@pytest.mark.parametrize("path", ["file/file", "file/folder/file", "folder"])
def test_error_names_file(tmp_path: Path, path: str):
    (tmp_path / "file").write_text("text")
    (tmp_path / "folder").mkdir()
    before = tree(tmp_path)
    with pytest.raises(CxbridgeError, match="cannot be written") as caught:
        write_file(tmp_path / path, "text")
    assert caught.value.file == str(tmp_path / path)
    assert tree(tmp_path) == before


def test_interrupt_leaves_no_file(tmp_path: Path):
    def write() -> None:
        with replaced_file(tmp_path / "file") as fresh:
            fresh.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write()
    assert not tree(tmp_path)
