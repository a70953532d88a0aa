"""Repair of recorded runs that are truncated or have wrong headers; see docs/formats.md.

:func:`examine` finds the damage of a file and changes nothing; the returned :class:`Repair` writes the
repaired file. Texts about the damage begin with ``FIXING:``, as those of Fawkes' ``ffbblog repair`` do.
"""

from __future__ import annotations

import os
import shutil
import stat
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from cxbridge.errors import TraceError
from cxbridge.file_access import replaced_file
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.files import reading, writing
from cxbridge.trace.formats.registry import open_run

_SEARCH_SIZE = 1 << 16  # the number of bytes that are searched at once for the last line feed


@dataclass(frozen=True)
class Repair:
    """The damage of a file and its repair.

    :param actions: the changes, as texts for the user; empty for an intact file.
    :param write: writes the repaired file to a path.
    """

    path: Path
    format: str
    actions: list[str]
    write: Callable[[Path], object]

    def write_copy(self, target: Path) -> None:
        """Write the repaired file to ``target`` atomically, replacing an existing file.

        :raises CxbridgeError: if the file cannot be written.
        """
        with replaced_file(target) as temporary_path:
            self.write(temporary_path)
            # a recording may be read-only, but its repaired copy is opened for writing
            temporary_path.chmod(self.path.stat().st_mode | stat.S_IWUSR)

    def write_with_backup(self) -> Path:
        """Repair the file; return the path of the backup.

        :raises CxbridgeError: if the backup or the repaired file cannot be written.
        """
        backup = _find_unused_backup_path(self.path)
        try:
            # a link is cheap and safe: the repaired file replaces the name, not the content
            os.link(self.path, backup)
        except OSError:  # a file system without links
            with writing(backup):
                shutil.copy2(self.path, backup)
        self.write_copy(self.path)
        return backup


def examine(path: Path) -> Repair:
    """Return the damage of a recorded run without changing the file.

    :raises TraceError: if the file is not a recorded run, cannot be read, or cannot be repaired.
    """
    run = open_run(path)
    if (actions_and_write := run.find_repairs()) is not None:
        return Repair(path, run.format, *actions_and_write)
    if path.is_dir():
        raise TraceError("this is a folder", file=path, hint="repair the files in the folder, one by one")
    if run.format == "mcap":
        from cxbridge_studio.repair.mcap import examine_mcap  # noqa: PLC0415 - repairs of other files start faster

        actions, write = examine_mcap(path)
        return Repair(path, run.format, actions, write if actions else partial(shutil.copyfile, path))
    return _examine_text(run)


def check_events(path: Path) -> None:
    """Read all events of a recorded run.

    :raises TraceError: if an event cannot be read, which no repair can mend.
    """
    for _ in open_run(path):
        pass


def _examine_text(run: Run) -> Repair:
    """Return the repair of a text recording, which removes an incomplete last line.

    :raises TraceError: if the file cannot be read, or no line is complete.
    """
    with reading(run.path):
        size = run.path.stat().st_size
    end = _find_end_of_lines(run.path, size)
    # the text of ffbblog, with its spelling
    actions = [f"FIXING: errorneous bytes at end of file, truncating by {size - end} b"] if end < size else []
    if not end and size:
        raise TraceError("no line of the recording is complete", file=run.path)
    return Repair(run.path, run.format, actions, partial(_copy_start, run.path, end))


def _copy_start(source: Path, size: int, target: Path) -> None:
    """Copy the first bytes of a file."""
    shutil.copyfile(source, target)
    os.truncate(target, size)


def _find_end_of_lines(path: Path, size: int) -> int:
    """Return the offset of the end of the last complete line of a file; 0 if no line is complete."""
    with reading(path), path.open("rb") as file:
        end = size
        while end:
            start = max(end - _SEARCH_SIZE, 0)
            file.seek(start)
            line_feed = file.read(end - start).rfind(b"\n")
            if line_feed >= 0:
                return start + line_feed + 1
            end = start
    return 0


def _find_unused_backup_path(path: Path) -> Path:
    """Return an unused name for the backup of a file."""
    backup = path.with_name(f"{path.name}.bak")
    number = 1
    while os.path.lexists(backup):
        number += 1
        backup = path.with_name(f"{path.name}.bak{number}")
    return backup
