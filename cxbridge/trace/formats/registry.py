"""The formats of recorded runs, and opening of a run by its content.

A module or package of this folder, or one that a plug-in adds to :data:`FORMAT_MODULES`, has formats if it
has ``FORMATS``, a tuple of :class:`.base.Format`, or ``COPIES``, a tuple of :class:`.base.CopyFormat`. The
module of a format in which runs can be recorded also has ``RECORDING``, the ``module:function`` that opens a
path for a :class:`.base.RecordingInfo`.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from pkgutil import resolve_name
from types import ModuleType
from typing import Any, Final

import cxbridge.trace.formats
from cxbridge.errors import TraceError
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.plugins import Row, Table, is_module, make_module_rows, package_hint
from cxbridge.trace.formats.base import HEAD_SIZE, CopyFormat, Format, Run
from cxbridge.trace.formats.files import reading

_SIGNATURE_SIZE: Final = 8  # bytes; known_plugins.json has those of files of plug-ins, as hexadecimal digits

FORMAT_MODULES: Final[Table[ModuleType]] = Table(
    "FORMATS",
    is_module,
    "a module with FORMATS or COPIES",
    *make_module_rows(cxbridge.trace.formats),
)
"""The modules of formats."""


def readable_formats() -> tuple[Format, ...]:
    """Return the readable formats, the most reliably recognised first."""
    return _load_formats(FORMAT_MODULES.rows, "FORMATS")


def copy_formats() -> dict[str, CopyFormat]:
    """Return the formats to which runs can be copied, by name."""
    return {copy_format.name: copy_format for copy_format in _load_formats(FORMAT_MODULES.rows, "COPIES")}


@lru_cache(maxsize=8)  # the rows change only with the installed plug-ins
def _load_formats(rows: tuple[Row, ...], constant_name: str) -> tuple[Any, ...]:
    """Return the formats in a constant of all modules, ``FORMATS`` or ``COPIES``, sorted by rank."""
    formats = [
        module_format
        for module in [FORMAT_MODULES.load_target(row) for row in rows]
        for module_format in getattr(module, constant_name, ())
    ]
    return tuple(sorted(formats, key=lambda module_format: module_format.rank))


def open_run(path: str | Path, registry: InterfaceRegistry | None = None) -> Run:
    """Open a recorded run of any format.

    :param path: a file, or a folder of the files of a format.
    :param registry: the interface types; None: the shipped types.
    :raises TraceError: if ``path`` does not exist, cannot be read, or is not a recorded run.
    """
    path = Path(path)
    with reading(path):
        head = _read_head(path)
        run_format = next(
            (candidate for candidate in readable_formats() if candidate.recognises(path, head)), None
        )
    if run_format is not None:
        reader: Callable[[Path, InterfaceRegistry | None], Run] = resolve_name(run_format.reader)
        return reader(path, registry)
    raise TraceError(
        "not a recorded run" if head or path.is_dir() else "the file is empty",
        file=path,
        hint=_package_hint(path, head)
        or "expected an mcap file, a text log of Fawkes, a transitions text, or, with plug-ins, bblogger "
        "files, CLIPS' watch items as text and bags of ROS 2",
    )


def _package_hint(path: Path, head: bytes) -> str:
    """Return a hint to the absent package that reads the file or folder; empty if no package is known.

    :param head: the first bytes of the file. A folder is known by the first bytes of its first log, as in the
        folders of bblogger.
    """
    if path.is_dir() and (logs := sorted(path.glob("*.log"))):
        head = _read_head(logs[0])
    return package_hint(f"a file that begins with {head[:_SIGNATURE_SIZE].hex()}")


def _read_head(path: Path) -> bytes:
    """Return the start of a file; empty for a folder.

    :raises TraceError: if the path is neither a file nor a folder.
    :raises OSError: if the file or folder cannot be read.
    """
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        with os.scandir(path) as entries:  # raises an error if the folder cannot be listed
            for entry in entries:
                entry.stat(follow_symlinks=False)  # raises an error if files of the folder cannot be accessed
                break
        return b""
    if not stat.S_ISREG(mode):
        raise TraceError("this is neither a file nor a folder", file=path, hint="copy it into a file first")
    with path.open("rb") as file:
        return file.read(HEAD_SIZE)
