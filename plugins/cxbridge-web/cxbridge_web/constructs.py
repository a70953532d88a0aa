"""The locations and source texts of constructs, read from CLIPS files.

CLIPS keeps neither, so the page reads the files of an environment again.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

from msgspec import UNSET, Meta, UnsetType

import cxbridge.executive
from cxbridge.clipstext.syntax import definitions
from cxbridge.printing import short_path
from cxbridge_web.models import Model

_CORE_FOLDER = Path(cxbridge.executive.__file__).parent / "clips"


class Construct(Model, kw_only=True):
    """A construct of a loaded file."""

    construct: str  # the kind, under its name in the API: `defrule`, `deftemplate` ...
    name: str
    file: str  # relative to the working directory if the file is below it
    line: int
    core: Annotated[bool, Meta(description="whether the construct is part of the CX core, not of the agent")]
    text: str | UnsetType = UNSET


class SourceConstructs:
    """The constructs of CLIPS files, cached until a file changes. Thread-safe."""

    def __init__(self) -> None:
        # the time of the last modification, and the constructs, by file
        self._files: dict[str, tuple[int, tuple[Construct, ...]]] = {}
        self._lock = threading.Lock()

    def find_constructs(self, files: Sequence[str]) -> dict[tuple[str, str], Construct]:
        """Return the constructs of files by kind and name; the last duplicate wins."""
        with self._lock:
            constructs = [
                construct for file in dict.fromkeys(files) for construct in self._read_constructs(file)
            ]
        return {(construct.construct, construct.name): construct for construct in constructs}

    def _read_constructs(self, file: str) -> tuple[Construct, ...]:
        try:
            modification_ns = Path(file).stat().st_mtime_ns
            if file not in self._files or self._files[file][0] != modification_ns:
                self._files[file] = modification_ns, tuple(_parse_file(Path(file)))
        except OSError:  # a file may be deleted after an environment has loaded it
            return ()
        return self._files[file][1]


def _parse_file(file: Path) -> Iterator[Construct]:
    is_core = file.resolve().is_relative_to(_CORE_FOLDER)
    for definition in definitions(file.read_bytes().decode("utf-8", "replace")):
        yield Construct(
            construct=definition.kind,
            name=definition.name,
            file=short_path(file),
            line=definition.line,
            core=is_core,
            text=definition.node.text,
        )
