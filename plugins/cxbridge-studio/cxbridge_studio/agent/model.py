"""The names in all files of an agent, updated file by file.

A name has mentions: the positions where the name is written, each with a use such as *defined* or *matched*.
A file consists of pieces, such as constructs; an unchanged construct of CLIPS is not read again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path, PurePath
from typing import Final, NamedTuple

from cxbridge_studio.agent.clips import read_clips
from cxbridge_studio.agent.interface_xml import read_interface
from cxbridge_studio.agent.lua import read_lua
from cxbridge_studio.agent.names import Mention, Name, NameKind, SourceFile, Use
from cxbridge_studio.agent.pddl import read_pddl
from cxbridge_studio.agent.yaml import read_yaml

_READERS: Final[Mapping[str, Callable[[str, str], SourceFile]]] = {
    ".pddl": read_pddl,
    ".yaml": read_yaml,
    ".yml": read_yaml,
    ".lua": read_lua,
    ".xml": read_interface,
}
SUFFIXES: Final = (".clp", *_READERS)  # the suffixes of an agent's files

# The blackboard feature makes a deftemplate from each interface, so the definition of a template and its
# slots may be an interface and its fields.
_COUNTERPARTS: Final = {
    NameKind.TEMPLATE: NameKind.INTERFACE,
    NameKind.SLOT: NameKind.FIELD,
    NameKind.INTERFACE: NameKind.TEMPLATE,
    NameKind.FIELD: NameKind.SLOT,
}


def read_source(path: str, text: str, previous_file: SourceFile | None = None) -> SourceFile | None:
    """Read a file with the reader for its suffix; return None for an unknown suffix.

    :param previous_file: the previous version of the file; the pieces of unchanged CLIPS constructs are
        reused.
    """
    suffix = PurePath(path).suffix
    if suffix == ".clp":
        return read_clips(path, text, previous_file)
    reader = _READERS.get(suffix)
    return None if reader is None else reader(path, text)


class FileMention(NamedTuple):
    """A mention, with offsets in the file that contains the mention."""

    file: SourceFile
    mention: Mention


class AgentModel:
    """The files of an agent and the names in them.

    No file is executed, and broken files are read as far as possible. :meth:`update` reuses unchanged CLIPS
    constructs. Queries search the index of each file.
    """

    def __init__(self) -> None:
        self._files: dict[str, SourceFile] = {}

    def update(self, path: str, text: str) -> SourceFile | None:
        """Parse the new text of a file, and add or replace the file; return None for an unknown suffix."""
        file = read_source(path, text, self._files.get(path))
        if file is not None:
            self.add_file(file)
        return file

    def read(self, path: Path) -> SourceFile | None:
        """Read a file from the disk, and add or replace the file.

        Return None if the file cannot be read, or has an unknown suffix.
        """
        try:
            text = path.read_bytes().decode("utf-8", "surrogateescape")
        except OSError:
            return None
        return self.update(str(path), text)

    @property
    def files(self) -> tuple[SourceFile, ...]:
        return tuple(self._files.values())

    def find_file(self, path: str) -> SourceFile | None:
        return self._files.get(path)

    def add_file(self, file: SourceFile) -> None:
        """Add a parsed file, or replace its previous version."""
        self._files[file.path] = file

    def remove(self, path: str) -> None:
        """Remove a file; an unknown path has no effect."""
        self._files.pop(path, None)

    def find_mentions(self, name: Name, *uses: Use) -> Iterator[FileMention]:
        """Yield the mentions of a name in all its kinds (see :func:`find_name_variants`), file by file.

        :param uses: the uses to include; without uses, all mentions are included.
        """
        names = find_name_variants(name)
        for file in self._files.values():
            placed_mentions = [
                placed_mention
                for variant in names
                for placed_mention in file.mentions_by_name.get(variant, ())
            ]
            # In the order of the text: a piece may have mentions of two variants.
            for start, mention in sorted(placed_mentions, key=lambda placed: placed[0] + placed[1].start):
                if not uses or mention.use in uses:
                    yield FileMention(file, mention.shifted(start))

    def find_calls(self, function: str) -> Iterator[FileMention]:
        """Yield the calls of a function, including the calls in ordered facts, which look like slots."""
        yield from self.find_mentions(Name(NameKind.FUNCTION, function), Use.CALLED)
        for file in self._files.values():
            for start, piece in file.pieces:
                for mention in piece.asserted_slots.get(function, ()):
                    if not self.is_defined(Name(NameKind.TEMPLATE, mention.name.owner)):
                        yield FileMention(file, mention.shifted(start))

    def find_definitions(self, name: Name) -> list[FileMention]:
        return list(self.find_mentions(name, Use.DEFINED))

    def is_defined(self, name: Name) -> bool:
        return next(self.find_mentions(name, Use.DEFINED), None) is not None

    def find_definitions_of_kind(self, kind: NameKind, owner: str | None = None) -> Iterator[FileMention]:
        """Yield the definitions of all names of a kind.

        :param owner: the owner of the names, such as a template for slots; None for any owner.
        """
        for file in self._files.values():
            for start, piece in file.pieces:
                for mention in piece.definitions:
                    if mention.name.kind is kind and owner in (None, mention.name.owner):
                        yield FileMention(file, mention.shifted(start))

    def find_names(self, kind: NameKind, *uses: Use, owner: str | None = None) -> set[str]:
        """Return the texts of the names of a kind that have one of the uses; without uses, of all of them.

        :param owner: the owner of the names, such as a template for slots; None for any owner.
        """
        return {
            name.text
            for file in self._files.values()
            for name, placed_mentions in file.mentions_by_name.items()
            if name.kind is kind
            and owner in (None, name.owner)
            and (not uses or any(mention.use in uses for _, mention in placed_mentions))
        }


def find_name_variants(name: Name) -> tuple[Name, ...]:
    """Return a name in all its kinds: an interface is also a template, and its fields are slots."""
    kind = _COUNTERPARTS.get(name.kind)
    return (name,) if kind is None else (name, name._replace(kind=kind))
