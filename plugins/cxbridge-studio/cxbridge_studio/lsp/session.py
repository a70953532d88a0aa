"""The state of the server: the model of the agent, the loaded files, and the last examination.

The model has the names in the agent's files, with their uses and positions. It comes from the text alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import Final

from cxbridge_studio.agent.model import SUFFIXES, AgentModel, FileMention
from cxbridge_studio.agent.names import Name, NameKind, SourceFile
from cxbridge_studio.lsp.knowledge import AgentKnowledge

_SCENARIO_FILE: Final = "scenario.yaml"  # a run finds this file by its folder
_CONFIGURATION_FILES: Final = ("cfg/config.yaml", "config.yaml")
# folders that usually have generated or foreign files
_SKIPPED_FOLDERS: Final = frozenset({"node_modules", "__pycache__", "build", "site"})
# limits, since the folder in the editor may be a whole checkout
_MAX_FILE_BYTES: Final = 1 << 20
_MAX_FILES: Final = 5000


@dataclass
class Session:
    """The state of the server.

    :ivar library: the paths of the CLIPS files that the executive itself or a feature loads.
    :ivar knowledge: the result of the last examination.
    :ivar root: the folder that is open in the editor; None if no folder is open.
    :ivar is_indexed: whether all files have been read once.
    """

    model: AgentModel = field(default_factory=AgentModel)
    library: set[str] = field(default_factory=set)
    knowledge: AgentKnowledge = field(default_factory=AgentKnowledge)
    root: Path | None = None
    is_indexed: bool = False
    # the last collected definitions: visible in files that the spec loads (True), and in other files (False)
    _definitions_cache: dict[bool, AgentDefinitions] = field(default_factory=dict)

    def find_definitions(self, path: str) -> AgentDefinitions:
        """Return the definitions visible in a file.

        A file that the spec loads sees no definitions in unloaded CLIPS files, except in the library.
        """
        is_loaded = path in self.knowledge.loaded_files
        files = tuple(file for file in self.model.files if not is_loaded or self._is_visible(file.path))
        definitions = self._definitions_cache.get(is_loaded)
        # cached, since the diagnostics of a file need the definitions after each change of its text
        if definitions is None or definitions.files != files:
            definitions = self._definitions_cache[is_loaded] = AgentDefinitions(files)
        return definitions

    def _is_visible(self, path: str) -> bool:
        """Return whether a loaded file sees a file; an unloaded CLIPS file may belong to another agent."""
        return not path.endswith(".clp") or path in self.knowledge.loaded_files or path in self.library

    def filter_visible(self, mentions: Iterable[FileMention], from_path: str) -> list[FileMention]:
        """Return the mentions that are visible in a file; all mentions if none is visible there.

        :param from_path: the path of the file in which the user asks about the name.
        """
        all_mentions = list(mentions)
        is_loaded = from_path in self.knowledge.loaded_files
        visible_mentions = [
            mention for mention in all_mentions if not is_loaded or self._is_visible(mention.file.path)
        ]
        return visible_mentions or all_mentions


class AgentDefinitions:
    """The names that files define, by kind.

    :ivar slots: the slot names by template or interface.
    """

    def __init__(self, files: tuple[SourceFile, ...]) -> None:
        self.files = files
        self._names: dict[NameKind, set[str]] = {}
        self.slots: dict[str, set[str]] = {}
        for file in files:
            for _, piece in file.pieces:
                for mention in piece.definitions:
                    self._add(mention.name)

    def _add(self, name: Name) -> None:
        self._names.setdefault(name.kind, set()).add(name.text)
        if name.kind is NameKind.TEMPLATE:
            self.slots.setdefault(name.text, set())
        elif name.kind is NameKind.INTERFACE:
            # the feature blackboard adds these slots to the template of each interface
            self.slots.setdefault(name.text, set()).update(("id", "time"))
        elif name.kind in (NameKind.SLOT, NameKind.FIELD):
            self.slots.setdefault(name.owner, set()).add(name.text)

    def find_names(self, kind: NameKind) -> set[str]:
        return self._names.get(kind, set())


def find_agent_files(folder: Path, suffixes: Iterable[str] = SUFFIXES) -> Iterator[Path]:
    """Yield the files of an agent below a folder.

    Large files, hidden files, and files in hidden or skipped folders are left out. The search ends with
    the folder in which the number of files reaches the limit.
    """
    allowed_suffixes = frozenset(suffixes)
    pending_folders = [folder]
    file_count = 0
    while pending_folders and file_count < _MAX_FILES:
        try:
            paths = sorted(pending_folders.pop().iterdir())
        except OSError:  # the folder cannot be read
            continue
        for path in paths:
            if path.name.startswith(".") or path.name in _SKIPPED_FOLDERS:
                continue
            if path.is_dir() and not path.is_symlink():  # links to folders could form a ring
                pending_folders.append(path)
            elif (
                path.suffix in allowed_suffixes and path.is_file() and path.stat().st_size <= _MAX_FILE_BYTES
            ):
                file_count += 1
                yield path.resolve()


def find_scenario(root: Path) -> Path | None:
    """Return the folder of a scenario, or the configuration file of a scenario without ``scenario.yaml``.

    Without either in the folder itself, the only scenario in its direct subfolders is returned. None means
    that there is no scenario, or that several subfolders have one.
    """
    if (root / _SCENARIO_FILE).is_file():
        return root
    for name in _CONFIGURATION_FILES:
        if (root / name).is_file():
            return root / name
    scenarios = sorted(root.glob(f"*/{_SCENARIO_FILE}"))
    return scenarios[0].parent if len(scenarios) == 1 else None


def find_last_recording(root: Path) -> Path | None:
    """Return the newest recording in a folder or its direct subfolders; None if there is none."""
    recordings = [*root.glob("*.mcap"), *root.glob("*/*.mcap")]
    return max(recordings, key=lambda path: path.stat().st_mtime, default=None)


def find_comment_above(text: str, offset: int) -> str:
    """Return the comment directly above the line of an offset, without comment marks; may be empty."""
    lines_above = map(str.strip, reversed(text[: text.rfind("\n", 0, offset) + 1].splitlines()))
    comment_lines = takewhile(lambda line: line.startswith((";", "--", "#")), lines_above)
    return "\n".join(reversed([line.lstrip(";-# ") for line in comment_lines])).strip()
