"""The checkpoint file of an interrupted exploration.

A resumed exploration continues from the file, and yields the same counts as an uninterrupted exploration.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Literal

from msgspec import DecodeError, Struct
from msgspec.msgpack import Decoder, encode

from cxbridge import __version__
from cxbridge.errors import CxbridgeError
from cxbridge.file_access import write_file
from cxbridge.run.options import RunOptions
from cxbridge_explore.bounds import Bounds
from cxbridge_explore.graph import Graph
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.run import MakeAssembly


class _Checkpoint(Struct, frozen=True):
    """The content of the file.

    :param kind: identifies the file format.
    :param identity: the explored program, as :func:`make_identity` returns it.
    """

    kind: Literal["cxbridge exploration"]
    identity: dict[str, str]
    graph: Graph


# Texts that identify the explored program, by subject such as options, world, properties and files.
ProgramIdentity = Mapping[str, str]


def make_identity(
    options: RunOptions,
    bounds: Bounds,
    properties: Sequence[Property],
    world: WorldModel | None,
    make_assembly: MakeAssembly,
) -> ProgramIdentity:
    """Return the identity of the explored program: what influences the runs and their verdicts.

    Of the files outside of the scenario's folder, the identity has only the paths in the options.
    """
    identity = {field.name: str(getattr(bounds, field.name)) for field in fields(bounds)}
    identity |= {field.name: str(getattr(options, field.name)) for field in fields(options)}
    # A game of a plug-in has its seed in the bound method or in the arguments.
    assembly_call = make_assembly if isinstance(make_assembly, partial) else partial(make_assembly)
    return identity | {
        "world": repr(world),
        "properties": "\n".join(f"{property_.name}: {property_.text}" for property_ in properties),
        "game or its seed": f"{assembly_call.args}{getattr(assembly_call.func, '__self__', '')}",
        "version": __version__,
        "files of the agent": _compute_digest(options),
    }


def write_checkpoint(file: Path, graph: Graph, identity: ProgramIdentity) -> None:
    """Write the explored graph with its open edges.

    :param identity: see :func:`make_identity`.
    :raises CxbridgeError: if the file cannot be written; an existing file stays unchanged.
    """
    write_file(file, encode(_Checkpoint("cxbridge exploration", dict(identity), graph)))


def load_checkpoint(file: Path, identity: ProgramIdentity) -> Graph:
    """Return the explored graph in a file.

    :param identity: see :func:`make_identity`.
    :raises CxbridgeError: if the file is not a checkpoint, or belongs to another exploration.
    """
    try:
        checkpoint = Decoder(_Checkpoint).decode(file.read_bytes())
    except OSError as error:
        raise CxbridgeError(f"cannot be read: {error.strerror}", file=file) from error
    except (DecodeError, UnicodeDecodeError) as error:
        raise CxbridgeError("is not the checkpoint of an exploration", file=file) from error
    different_subjects = [
        subject for subject in identity if checkpoint.identity.get(subject) != identity[subject]
    ]
    if different_subjects:
        raise CxbridgeError(
            f"belongs to another exploration; different: {', '.join(different_subjects)}",
            file=file,
            hint="use the same options and the same agent as before, or start again without --resume",
        )
    return checkpoint.graph


def _compute_digest(options: RunOptions) -> str:
    """Return a digest of the files in the scenario's folder; empty without a folder."""
    folder = options.scenario
    if folder is None or not folder.is_dir():
        return ""
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:  # a run changes the cache
            digest.update(f"{file.relative_to(folder)}\0".encode("utf-8", "surrogateescape"))
            digest.update(file.read_bytes())
    return digest.hexdigest()
