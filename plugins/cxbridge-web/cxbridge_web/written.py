"""Where the constructs of CLIPS files are written, and their text."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cxbridge.executive
from cxbridge.clipstext.syntax import definitions
from cxbridge.printing import short_path

_CORE = Path(cxbridge.executive.__file__).parent / "clips"


@dataclass(frozen=True, slots=True)
class WrittenConstruct:
    """A construct of a file.

    :param kind: ``defrule``, ``deftemplate`` ...
    :param file: as seen from the working directory, if it is below that.
    :param line: where it begins, from 1.
    :param core: whether its file is one of the CX core's, and not of the agent.
    :param text: the source text, comments included.
    """

    kind: str
    name: str
    file: str
    line: int
    core: bool
    text: str


class WrittenConstructs:
    """The constructs of files; files are read again when they have changed. For any thread."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[int, tuple[WrittenConstruct, ...]]] = {}
        self._lock = threading.Lock()

    def of(self, files: Sequence[str]) -> dict[tuple[str, str], WrittenConstruct]:
        """Return the constructs of files by kind and name; of several the last."""
        with self._lock:
            found = [construct for file in dict.fromkeys(files) for construct in self._in(file)]
        return {(construct.kind, construct.name): construct for construct in found}

    def _in(self, file: str) -> tuple[WrittenConstruct, ...]:
        try:
            changed = Path(file).stat().st_mtime_ns
            if file not in self._files or self._files[file][0] != changed:
                self._files[file] = changed, tuple(_read(Path(file)))
        except OSError:
            return ()
        return self._files[file][1]


def _read(file: Path) -> Iterator[WrittenConstruct]:
    core = file.resolve().is_relative_to(_CORE)
    for found in definitions(file.read_bytes().decode("utf-8", "replace")):
        yield WrittenConstruct(found.kind, found.name, short_path(file), found.line, core, found.node.text)
