"""Which CLIPS files a spec loads, and in which order: from its configuration and from what the files load."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import SyntaxNode, literal, read
from cxbridge.config import Configuration, ConfigValue, Mark
from cxbridge.file_access import is_readable_file
from cxbridge_studio.agent.names import Mention, NameKind, SourceFile, Use

_STAGES: Final = ("stage-1", "stage-2", "stage-3")
_CORE_STAGE: Final = "stage-2"
_FIRST: Final = ("saliences.clp", "init.clp", "blackboard-init.clp")
_CORE_FILES: Final = "CX-STAGE2-FILES"
_CORE_FUNCTION: Final = "cx-stage2-files"
_CLIPS: Final = re.compile(r"[^|]+\.clp")


class LoadedFile(Struct, frozen=True):
    """A file that a spec, or one of its files, loads.

    :param name: as it is asked for.
    :param path: where it is; None when no folder has it.
    :param asked_by: the file that asks; empty for the core.
    :param line: where, from 1; 0 for the core. ``column`` likewise.
    """

    name: str
    path: Path | None
    asked_by: str = ""
    line: int = 0
    column: int = 0


class SpecLoading(Struct, frozen=True):
    """Finds what a spec loads.

    :param folders: where files are searched for, in their order; the core's is one of them.
    :param core: the folder of the core.
    :param read: gives a file by its path; None when it cannot be read.
    """

    folders: Sequence[Path]
    core: Path
    read: Callable[[Path], SourceFile | None]

    def find(self, name: str) -> Path | None:
        """Return the file that has a name; None when no folder has it."""
        paths = (folder / name for folder in self.folders)
        return next((path for path in paths if is_readable_file(path)), None)

    def files(self, config: Configuration, spec: str) -> list[LoadedFile]:
        """Return the files of a spec in the order they are loaded, each once; missing ones too."""
        found: dict[Path | str, LoadedFile] = {}
        for asked in self._asked(config, spec):
            self._load(asked, found)
        return list(found.values())

    def _asked(self, config: Configuration, spec: str) -> Iterator[LoadedFile]:
        """Yield what core and configuration ask for."""
        for name in _FIRST:
            if (self.core / name).is_file():
                yield LoadedFile(name, self.core / name)
        for stage in _STAGES:
            if stage == _CORE_STAGE:
                for name in self._core_files():
                    yield LoadedFile(name, self.find(name))
            base = f"/clips-executive/specs/{spec}/init/{stage}"
            for entry in config.keys(base):
                for key in ("file", "files"):
                    path = f"{base}/{entry}/{key}"
                    if config.exists(path):
                        yield from self._of_value(config.get(path))

    def _of_value(self, value: ConfigValue) -> Iterator[LoadedFile]:
        for text in value.items if value.is_list else (value.text,):
            name = text.rpartition("|")[2]
            mark: Mark = value.mark
            yield LoadedFile(name, self.find(name), mark.file, mark.line, mark.column)

    def _core_files(self) -> list[str]:
        """Return the files that the core loads: strings of a global, and of the function that adds some."""
        init = self.read(self.core / "init.clp")
        if init is None:
            return []
        names: list[str] = []
        for _, piece in init.pieces:
            if piece.keyword == "defglobal":
                names += _strings_of_global(read(piece.text, close=True)[0])
            elif piece.name is not None and piece.name.text == _CORE_FUNCTION:
                words = (literal(node) for node in read(piece.text, close=True)[0].walk())
                names += [word for word in words if _CLIPS.fullmatch(word)]
        return list(dict.fromkeys(names))

    def _load(self, asked: LoadedFile, found: dict[Path | str, LoadedFile]) -> None:
        waiting = [asked]
        while waiting:
            each = waiting.pop()
            key: Path | str = each.name if each.path is None else each.path.resolve()
            if key in found:
                continue
            found[key] = each
            file = None if each.path is None else self.read(each.path)
            if file is not None:
                waiting += reversed([self._of_mention(file, mention) for mention in _loads(file)])

    def _of_mention(self, file: SourceFile, mention: Mention) -> LoadedFile:
        lines = file.lines
        place = lines.at(mention.start), lines.column(mention.start)
        return LoadedFile(mention.name.text, self.find(mention.name.text), file.path, *place)


def _loads(file: SourceFile) -> list[Mention]:
    """Return where a file loads others."""
    return [
        mention
        for mention in file.mentions
        if mention.name.kind is NameKind.FILE
        and mention.use is Use.NAMED
        and _CLIPS.fullmatch(mention.name.text)
    ]


def _strings_of_global(node: SyntaxNode) -> list[str]:
    """Return the names of files in the variable that lists the core's."""
    for name, _sign, value in zip(node.arguments, node.arguments[1:], node.arguments[2:], strict=False):
        if name.text == f"?*{_CORE_FILES}*":
            return [
                literal(item).rpartition("|")[2] for item in value.walk() if literal(item).endswith(".clp")
            ]
    return []
