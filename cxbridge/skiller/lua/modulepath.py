"""The search path of Lua modules, and the detection of changed skill files."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from cxbridge.errors import SkillError

_MODULE_NAME = re.compile(r"[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*")
# a place in a message of Lua: LABEL:LINE:
_PLACE = re.compile(r"([^\s:|]+):(\d{1,9}):")
# editors of Windows write this mark at the start of a text, and Lua 5.1 refuses the mark
_BYTE_ORDER_MARK = b"\xef\xbb\xbf".decode("latin-1")
# a place in the Lua files of the engine at the start of an error
_OWN_PLACE = re.compile(r"^cxbridge/\w+\.lua:\d+: ")


Signature = tuple[Path, int, int, int]
"""The identity of a file's content: path, modification time, size and inode."""


class ModulePath:
    """Finds Lua modules in folders; the first match wins.

    A folder is a Lua folder like Fawkes' ``src/lua``, where ``skills.generic.say`` is
    ``skills/generic/say.lua``, or a folder of skills, where the same module is
    ``generic/say.lua``.

    :param folders: the folders of modules, in order of preference.
    """

    def __init__(self, folders: Iterable[Path]) -> None:
        self.folders = tuple(folders)
        self.files: dict[str, Path] = {}
        """The paths of the found modules, by their label in Lua's messages."""
        self.requested: dict[str, Signature | None] = {}
        """The requested modules with their signature at that time; None for a missing file."""

    def find(self, module: str) -> Path:
        """Return the file of a module.

        :raises SkillError: if the name is invalid, or no folder has the module.
        """
        if not _MODULE_NAME.fullmatch(module):
            raise SkillError(
                f"'{module}' is not the name of a Lua module",
                hint="a name must be words joined by dots: skills.generic.say",
            )
        for path in self._candidates(module):
            if path.is_file():
                return path
        folders = ", ".join(str(folder) for folder in self.folders) or "no folder at all"
        raise SkillError(
            f"Lua module '{module}' not found in {folders}",
            hint="name the folder of the module with --skill-dir",
        )

    def read(self, module: str) -> tuple[str, str]:
        """Return the text of a module and its label for messages.

        The text has a character for each byte, but all line ends are line feeds.

        Record the request in :attr:`requested`, and the file in :attr:`files`.

        :raises SkillError: if the module is missing or unreadable.
        """
        self.requested[module] = self.signature(module)
        path = self.find(module)
        label = module.replace(".", "/") + ".lua"
        self.files[label] = path
        try:
            return path.read_text("latin-1").removeprefix(_BYTE_ORDER_MARK), label
        except OSError as error:
            raise SkillError(f"cannot read Lua module '{module}': {error.strerror}", file=path) from None

    def signature(self, module: str) -> Signature | None:
        """Return the present signature of a module's file; None if the file is missing."""
        try:
            path = self.find(module)
            file_status = path.stat()
        except (SkillError, OSError):
            return None
        return path, file_status.st_mtime_ns, file_status.st_size, file_status.st_ino

    def _candidates(self, module: str) -> Iterator[Path]:
        words = module.split(".")
        for folder in self.folders:
            word_lists = [words, words[1:]] if words[0] == "skills" and len(words) > 1 else [words]
            for names in word_lists:
                stem = folder.joinpath(*names)
                yield stem.with_name(stem.name + ".lua")
                yield stem / "init.lua"

    def insert_paths(self, line: str) -> str:
        """Replace labels in a message by the paths of the skill files."""
        return _PLACE.sub(lambda match: f"{self.files.get(match[1], match[1])}:{match[2]}:", line)

    def locate(self, message: str) -> tuple[Path | None, int | None, str]:
        """Split a Lua error with traceback into file, line and text; None for an unknown file or line."""
        # the innermost place in a skill file counts: a mistake in a definition is raised in the engine's own
        # file
        text = _OWN_PLACE.sub("", message.partition("\nstack traceback:")[0])
        for label, line in _PLACE.findall(message):
            if label in self.files:
                return self.files[label], int(line), text.removeprefix(f"{label}:{line}: ")
        return None, None, text


class ModuleWatch:
    """Watches the files of modules, and the candidates of missing modules.

    Polling modification times needs no thread, works on every file system, and concerns only the requested
    modules, wherever they are.

    :param interval_s: seconds between two checks.
    :param now: a clock in real seconds, because files change in real time.
    """

    def __init__(self, interval_s: float = 0.5, now: Callable[[], float] = time.monotonic) -> None:
        self._interval_s = interval_s
        self._now = now
        self._next_check_s = now() + interval_s
        self._path = ModulePath(())

    def follow(self, path: ModulePath) -> None:
        """Watch the files that were requested on ``path``."""
        self._path = path
        self._next_check_s = self._now() + self._interval_s

    def find_changed_modules(self) -> list[str]:
        """Return the changed modules; empty before the next check is due."""
        if self._now() < self._next_check_s:
            return []
        self._next_check_s = self._now() + self._interval_s
        return [
            name
            for name, signature in self._path.requested.items()
            if self._path.signature(name) != signature
        ]
