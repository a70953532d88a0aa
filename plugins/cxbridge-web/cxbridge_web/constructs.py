"""Places and source texts of the constructs in CLIPS files, which a CLIPS environment does not keep."""

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
    :param file: relative to the working directory if it is below that.
    :param line: the first line, from 1.
    :param core: whether the file belongs to the CX core, not to the agent.
    :param text: the source text with comments.
    """

    kind: str
    name: str
    file: str
    line: int
    core: bool
    text: str


class WrittenConstructs:
    """The constructs of files, which are read again after changes; thread-safe."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[int, tuple[WrittenConstruct, ...]]] = {}
        self._lock = threading.Lock()

    def of(self, files: Sequence[str]) -> dict[tuple[str, str], WrittenConstruct]:
        """Return the constructs of files by kind and name; the last duplicate wins."""
        with self._lock:
            constructs = [construct for file in dict.fromkeys(files) for construct in self._in(file)]
        return {(construct.kind, construct.name): construct for construct in constructs}

    def _in(self, file: str) -> tuple[WrittenConstruct, ...]:
        try:
            modification_ns = Path(file).stat().st_mtime_ns
            if file not in self._files or self._files[file][0] != modification_ns:
                self._files[file] = modification_ns, tuple(_read(Path(file)))
        except OSError:
            return ()
        return self._files[file][1]


def _read(file: Path) -> Iterator[WrittenConstruct]:
    core = file.resolve().is_relative_to(_CORE)
    for definition in definitions(file.read_bytes().decode("utf-8", "replace")):
        yield WrittenConstruct(
            definition.kind, definition.name, short_path(file), definition.line, core, definition.node.text
        )
