"""Places and source texts of the constructs in CLIPS files, which a CLIPS environment does not keep."""

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

_CORE = Path(cxbridge.executive.__file__).parent / "clips"


class Construct(Model, kw_only=True):
    """A construct of a loaded file."""

    construct: str  # `defrule`, `deftemplate` ...
    name: str
    file: str  # relative to the working directory if it is below that
    line: int
    core: Annotated[bool, Meta(description="whether the construct is part of the CX core, not of the agent")]
    text: str | UnsetType = UNSET


class SourceConstructs:
    """The constructs of CLIPS files. A changed file is read again. Thread-safe."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[int, tuple[Construct, ...]]] = {}
        self._lock = threading.Lock()

    def of(self, files: Sequence[str]) -> dict[tuple[str, str], Construct]:
        """Return the constructs of files by kind and name; the last duplicate wins."""
        with self._lock:
            constructs = [construct for file in dict.fromkeys(files) for construct in self._of_file(file)]
        return {(construct.construct, construct.name): construct for construct in constructs}

    def _of_file(self, file: str) -> tuple[Construct, ...]:
        try:
            modification_ns = Path(file).stat().st_mtime_ns
            if file not in self._files or self._files[file][0] != modification_ns:
                self._files[file] = modification_ns, tuple(_read(Path(file)))
        except OSError:  # a file may be deleted after it was loaded
            return ()
        return self._files[file][1]


def _read(file: Path) -> Iterator[Construct]:
    core = file.resolve().is_relative_to(_CORE)
    for definition in definitions(file.read_bytes().decode("utf-8", "replace")):
        yield Construct(
            construct=definition.kind,
            name=definition.name,
            file=short_path(file),
            line=definition.line,
            core=core,
            text=definition.node.text,
        )
