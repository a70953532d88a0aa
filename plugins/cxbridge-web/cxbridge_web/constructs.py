"""The locations and source texts of constructs, read from CLIPS files.

CLIPS knows neither the files nor the original texts, so the web server reads an environment's files again.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Final

from msgspec import UNSET, Meta, UnsetType

import cxbridge.executive
from cxbridge.clipstext.syntax import definitions
from cxbridge.printing import short_path
from cxbridge_web.models import Model

_CORE_FOLDER: Final = Path(cxbridge.executive.__file__).parent / "clips"
_MAX_CACHED_FILES: Final = 1000  # more files than an agent has


class Construct(Model, kw_only=True):
    """A construct of a loaded file."""

    construct: str  # the kind, under its name in the API: `defrule`, `deftemplate` ...
    name: str
    file: str  # relative to the working directory for a file below that directory
    line: int
    core: Annotated[bool, Meta(description="whether the construct is part of the CX core, not of the agent")]
    text: str | UnsetType = UNSET


def find_constructs(files: Iterable[str]) -> dict[tuple[str, str], Construct]:
    """Return the constructs of files by kind and name; of duplicates the last, which CLIPS uses.

    Files that cannot be read are skipped.
    """
    constructs: dict[tuple[str, str], Construct] = {}
    for file in dict.fromkeys(files):
        with suppress(OSError):  # a file may be deleted after an environment has loaded it
            modification_ns = Path(file).stat().st_mtime_ns
            for construct in _parse_file(file, modification_ns):
                constructs[construct.construct, construct.name] = construct
    return constructs


@lru_cache(maxsize=_MAX_CACHED_FILES)
def _parse_file(file: str, _modification_ns: int) -> tuple[Construct, ...]:
    """Return the constructs of a file; a new time of modification makes a new entry in the cache."""
    path = Path(file)
    is_core = path.resolve().is_relative_to(_CORE_FOLDER)
    return tuple(
        Construct(
            construct=definition.kind,
            name=definition.name,
            file=short_path(path),
            line=definition.line,
            core=is_core,
            text=definition.node.text,
        )
        for definition in definitions(path.read_bytes().decode("utf-8", "replace"))
    )
