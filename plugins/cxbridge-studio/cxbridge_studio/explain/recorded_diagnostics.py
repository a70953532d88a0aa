"""Refused constructs in a recording, and folders with files that were not loaded."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import cxbridge.executive
from cxbridge.events import Level, LogLine
from cxbridge.executive.host.loading import Diagnostic

MOST_DIAGNOSTICS: Final = 1000  # number of first mistakes to keep

_CORE = Path(cxbridge.executive.__file__).parent / "clips"
_COMPONENT = re.compile(r"CLIPS \((.+)\)")
# Look for the end first: otherwise each colon is tried as the one after the file, in quadratic time.
_DIAGNOSTIC = re.compile(
    r"(?=.* \[\w+\]\Z)(.+?)(?::(\d{1,9}))?: (?:(def\w+ \S++) is not defined: )?(.*) \[(\w+)\]", re.DOTALL
)


class Refusals:
    """Reader of loader diagnostics from log lines, by environment."""

    def __init__(self) -> None:
        self._found: dict[str, list[Diagnostic]] = {}

    def take(self, event: LogLine) -> None:
        """Keep a log line if it is a diagnostic of the loader."""
        env = _COMPONENT.fullmatch(event.component)
        if env is None or event.level not in (Level.WARN, Level.ERROR):
            return
        match = _DIAGNOSTIC.fullmatch(event.text)
        known = self._found.setdefault(env[1], [])
        if match is not None and len(known) < MOST_DIAGNOSTICS:
            file, line, construct, message, code = match.groups()
            known.append(Diagnostic(file, int(line) if line else None, construct or "", code, message))

    def of(self, env: str) -> list[Diagnostic]:
        """Return the mistakes in the files of an environment."""
        return self._found.get(env, [])


def agent_folders(files: Iterable[tuple[str, str]]) -> list[str]:
    """Return the folders of an agent's files whose content equals the recorded content.

    :param files: paths and texts. A path alone does not open a folder: the recording may come from a
        stranger.
    """
    folders: dict[str, None] = {}
    for name, text in files:
        path = Path(name)
        if not path.is_absolute() or path.is_relative_to(_CORE) or str(path.parent) in folders:
            continue
        try:
            data = text.encode("utf-8", "surrogateescape")
            same = path.is_file() and path.stat().st_size == len(data) and path.read_bytes() == data
        except (OSError, ValueError):
            continue
        if same:
            folders[str(path.parent)] = None
    return list(folders)
