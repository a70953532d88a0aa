"""Questions about the names in files: where a name is written, defined and called."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from cxbridge_studio.agent.names import Mention, Name, NameKind, SourceFile, Use

_AS_TEMPLATE: Final = {NameKind.TEMPLATE: NameKind.INTERFACE, NameKind.SLOT: NameKind.FIELD}


class Found(NamedTuple):
    """A mention, and the file that it is in; its offsets are those of the file."""

    file: SourceFile
    mention: Mention


class NamedFiles:
    """Files, and questions about the names in them.

    A question looks through all files, by a table that each file has.

    :param files: the first files.
    """

    def __init__(self, files: Iterable[SourceFile] = ()) -> None:
        self._files = {file.path: file for file in files}

    @property
    def files(self) -> tuple[SourceFile, ...]:
        """All files."""
        return tuple(self._files.values())

    def file(self, path: str) -> SourceFile | None:
        """Return a file; None when it is not one of these."""
        return self._files.get(path)

    def take(self, file: SourceFile) -> None:
        """Take a file that was read already."""
        self._files[file.path] = file

    def remove(self, path: str) -> None:
        """Forget a file."""
        self._files.pop(path, None)

    def mentions(self, name: Name, *uses: Use) -> Iterator[Found]:
        """Yield where a name is written, in the order of the files; all its spellings (:func:`same_as`).

        :param uses: only where one of these is done with it; all when there is none.
        """
        wanted = same_as(name)
        for file in self._files.values():
            found = [place for each in wanted for place in file.by_name.get(each, ())]
            if len(wanted) > 1:
                found.sort(key=_start_of_piece)
            for start, mention in found:
                if not uses or mention.use in uses:
                    yield Found(file, mention.moved(start))

    def calls(self, function: str) -> Iterator[Found]:
        """Yield where a function is called, in ordered facts, too, where a call looks like a slot."""
        yield from self.mentions(Name(NameKind.FUNCTION, function), Use.CALLED)
        for file in self._files.values():
            for start, piece in file.pieces:
                for mention in piece.asserted_slots.get(function, ()):
                    if not self.is_defined(Name(NameKind.TEMPLATE, mention.name.owner)):
                        yield Found(file, mention.moved(start))

    def definitions(self, name: Name) -> list[Found]:
        """Return where a name is defined."""
        return list(self.mentions(name, Use.DEFINED))

    def is_defined(self, name: Name) -> bool:
        """Whether a file defines a name."""
        return next(self.mentions(name, Use.DEFINED), None) is not None

    def defined(self, kind: NameKind, owner: str | None = None) -> Iterator[Found]:
        """Yield the definitions of all names of a kind.

        :param owner: only of those that belong to this; None: of all.
        """
        for file in self._files.values():
            for start, piece in file.pieces:
                for mention in piece.defined:
                    if mention.name.kind is kind and owner in (None, mention.name.owner):
                        yield Found(file, mention.moved(start))

    def names(self, kind: NameKind, *uses: Use, owner: str | None = None) -> set[str]:
        """Return the names of a kind with which one of these things is done; without any, anything."""
        return {
            name.text
            for file in self._files.values()
            for name, places in file.by_name.items()
            if name.kind is kind
            and owner in (None, name.owner)
            and (not uses or any(mention.use in uses for _, mention in places))
        }


def _start_of_piece(place: tuple[int, Mention]) -> int:
    return place[0]


def same_as(name: Name) -> tuple[Name, ...]:
    """Return all spellings of a name: the template of an interface's facts has its name, slots are fields."""
    if name.kind in _AS_TEMPLATE:
        return name, Name(_AS_TEMPLATE[name.kind], name.text, name.owner)
    for template, interface in _AS_TEMPLATE.items():
        if name.kind is interface:
            return name, Name(template, name.text, name.owner)
    return (name,)
