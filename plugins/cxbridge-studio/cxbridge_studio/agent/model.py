"""The model of an agent: the names in its files, kept up to date one file at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path, PurePath
from typing import Final

from cxbridge_studio.agent.clips import read_clips
from cxbridge_studio.agent.interface_xml import read_interface
from cxbridge_studio.agent.lua import read_lua
from cxbridge_studio.agent.named_files import NamedFiles
from cxbridge_studio.agent.names import SourceFile
from cxbridge_studio.agent.pddl import read_pddl
from cxbridge_studio.agent.protobuf import read_proto
from cxbridge_studio.agent.yaml import read_yaml

_READERS: Final[Mapping[str, Callable[[str, str], SourceFile]]] = {
    ".pddl": read_pddl,
    ".yaml": read_yaml,
    ".yml": read_yaml,
    ".lua": read_lua,
    ".xml": read_interface,
    ".proto": read_proto,
}
SUFFIXES: Final = (".clp", *_READERS)
"""The endings of the files that an agent is made of."""


def read_source(path: str, text: str, before: SourceFile | None = None) -> SourceFile | None:
    """Return the names of a file, by its ending; None for a file of another sort.

    :param before: the file as it was: what has not changed in it is not read again.
    """
    suffix = PurePath(path).suffix
    if suffix == ".clp":
        return read_clips(path, text, before)
    reader = _READERS.get(suffix)
    return None if reader is None else reader(path, text)


class AgentModel(NamedFiles):
    """The files of an agent and the names in them. Nothing is run; broken files are read as far as they go.

    :meth:`update` costs what has changed: in a CLIPS file, constructs that are the same are kept.
    """

    def update(self, path: str, text: str) -> SourceFile | None:
        """Take the text of a file, a new one or one that has changed; None when it is of another sort."""
        file = read_source(path, text, self._files.get(path))
        if file is not None:
            self.take(file)
        return file

    def read(self, path: Path) -> SourceFile | None:
        """Take a file from the disk; None when it cannot be read."""
        try:
            text = path.read_bytes().decode("utf-8", "surrogateescape")
        except OSError:
            return None
        return self.update(str(path), text)
