"""An exploration that was interrupted, as a file: it goes on from there and comes to the same counts."""

from __future__ import annotations

import hashlib
from dataclasses import fields
from pathlib import Path
from typing import Literal

from msgspec import DecodeError, Struct
from msgspec.msgpack import Decoder, encode

from cxbridge import __version__
from cxbridge.errors import CxbridgeError
from cxbridge.explore.bounds import Bounds
from cxbridge.explore.graph import Graph, SavedGraph
from cxbridge.run.options import RunOptions


class _Checkpoint(Struct, frozen=True):
    """What is in the file.

    :param kind: what files of this kind begin with.
    :param about: the bounds, the options, the agent's files and the version; all must be the same.
    """

    kind: Literal["cxbridge exploration"]
    about: dict[str, str]
    graph: SavedGraph


def write_checkpoint(file: Path, graph: Graph, options: RunOptions, bounds: Bounds) -> None:
    """Write what was explored, and what is left.

    :raises OSError: when the file cannot be written; one that was there before is as it was.
    """
    data = encode(_Checkpoint("cxbridge exploration", _about(options, bounds), graph.save()))
    new = file.with_name(f"{file.name}.new")
    try:
        new.write_bytes(data)
        new.replace(file)
    except OSError:
        new.unlink(missing_ok=True)
        raise


def read_checkpoint(file: Path, graph: Graph, options: RunOptions, bounds: Bounds) -> None:
    """Take over what was explored.

    :raises CxbridgeError: when the file is none of ours, or of another exploration.
    """
    try:
        found = Decoder(_Checkpoint).decode(file.read_bytes())
    except OSError as error:
        raise CxbridgeError(f"cannot be read: {error.strerror}", file=file) from error
    except (DecodeError, UnicodeDecodeError) as error:
        raise CxbridgeError("is not an exploration that was interrupted", file=file) from error
    about = _about(options, bounds)
    different = [name for name in about if found.about.get(name) != about[name]]
    if different:
        raise CxbridgeError(
            f"is of another exploration: {', '.join(different)} differ"
            if different
            else "is of another kind",
            file=file,
            hint="give the same options as before, with the same agent; or begin again without --resume",
        )
    graph.load(found.graph)


def _about(options: RunOptions, bounds: Bounds) -> dict[str, str]:
    about = {each.name: str(getattr(bounds, each.name)) for each in fields(bounds)}
    about |= {each.name: str(getattr(options, each.name)) for each in fields(options)}
    return about | {"version": __version__, "files of the agent": _digest(options)}


def _digest(options: RunOptions) -> str:
    """Return a digest of the files in the folder of the scenario."""
    folder = options.scenario
    if folder is None or not folder.is_dir():
        return ""
    found = hashlib.sha256()
    for file in sorted(folder.rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            found.update(f"{file.relative_to(folder)}\0".encode("utf-8", "surrogateescape"))
            found.update(file.read_bytes())
    return found.hexdigest()
