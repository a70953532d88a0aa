"""The state of the server: the model of the agent, the loaded files, and the last examination.

The model has the names in the agent's files, with their uses and positions. It comes from the text alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Final

from cxbridge_studio.agent.model import SUFFIXES, AgentModel, FileMention
from cxbridge_studio.agent.names import Name, NameKind, SourceFile
from cxbridge_studio.lsp.knowledge import NO_KNOWLEDGE, AgentKnowledge

_SCENARIO_FILES: Final = ("scenario.yaml", "cfg/config.yaml", "config.yaml")
_SKIPPED_FOLDERS: Final = frozenset({"node_modules", "__pycache__", "build", "site"})
# limits, since the folder in the editor may be a whole checkout
_MAX_FILE_BYTES: Final = 1 << 20
_MAX_FILES: Final = 5000


@dataclass
class Session:
    """The state of the server.

    :ivar loaded_files: the paths of the files that the spec loads; empty without a spec.
    :ivar library: the paths of the host's files, which every agent has.
    :ivar knowledge: the result of the last examination.
    :ivar root: the folder that is open in the editor; None if no folder is open.
    :ivar is_indexed: whether all files have been read once.
    """

    model: AgentModel = field(default_factory=AgentModel)
    loaded_files: set[str] = field(default_factory=set)
    library: set[str] = field(default_factory=set)
    knowledge: AgentKnowledge = NO_KNOWLEDGE
    root: Path | None = None
    is_indexed: bool = False
    _revision: int = 0  # counts changes of files and knowledge
    # The definitions and their revision: for files that the spec loads (True), and for all other files
    # (False).
    _definitions_cache: dict[bool, tuple[int, AgentDefinitions]] = field(default_factory=dict)

    def update(self, path: str, text: str) -> SourceFile | None:
        """Update a file with new text; see :meth:`AgentModel.update`."""
        self._revision += 1
        return self.model.update(path, text)

    def read(self, path: Path) -> SourceFile | None:
        """Read a file from the disk; see :meth:`AgentModel.read`."""
        self._revision += 1
        return self.model.read(path)

    def remove(self, path: str) -> None:
        """Remove a file from the model."""
        self._revision += 1
        self.model.remove(path)

    def set_knowledge(self, knowledge: AgentKnowledge) -> None:
        """Store the result of an examination."""
        self._revision += 1
        self.knowledge, self.loaded_files = knowledge, set(knowledge.loaded_files)

    def is_agent_file(self, path: str) -> bool:
        """Return whether the spec or the host loads a file."""
        return path in self.loaded_files or path in self.library

    def find_definitions(self, path: str) -> AgentDefinitions:
        """Return the definitions visible in a file: a loaded file sees only definitions in loaded files."""
        # cached for a revision, since each key that the user presses needs the definitions
        is_loaded = path in self.loaded_files
        cached = self._definitions_cache.get(is_loaded)
        if cached is None or cached[0] != self._revision:
            files = (file for file in self.model.files if not is_loaded or self._is_visible(file.path))
            cached = (self._revision, AgentDefinitions(files))
            self._definitions_cache[is_loaded] = cached
        return cached[1]

    def _is_visible(self, path: str) -> bool:
        """Return whether a loaded file sees a file: unloaded CLIPS files may belong to another agent."""
        return not path.endswith(".clp") or self.is_agent_file(path)

    def filter_visible(self, mentions: Iterable[FileMention], from_path: str) -> list[FileMention]:
        """Return the mentions that are visible in a file; all mentions if none is visible there.

        :param from_path: the path of the file in which the user asks about the name.
        """
        all_mentions = list(mentions)
        if from_path in self.loaded_files:
            return [
                mention for mention in all_mentions if self._is_visible(mention.file.path)
            ] or all_mentions
        return all_mentions


class AgentDefinitions:
    """The names that a set of files defines, by kind.

    :ivar slots: the slot names by template or interface.
    """

    def __init__(self, files: Iterable[SourceFile]) -> None:
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
    """Yield the files of an agent below a folder, except large files and files in hidden folders."""
    allowed_suffixes = frozenset(suffixes)
    pending = [folder]
    count = 0
    while pending and count < _MAX_FILES:
        try:
            entries = sorted(pending.pop().iterdir())
        except OSError:
            continue
        for entry in entries:
            if entry.name.startswith(".") or entry.name in _SKIPPED_FOLDERS:
                continue
            if entry.is_dir() and not entry.is_symlink():
                pending.append(entry)
            elif (
                entry.suffix in allowed_suffixes
                and entry.is_file()
                and entry.stat().st_size <= _MAX_FILE_BYTES
            ):
                count += 1
                yield entry.resolve()


def find_scenario(root: Path) -> Path | None:
    """Return the scenario of a folder, or the only scenario in its subfolders; None if there is none."""
    for name in _SCENARIO_FILES:
        if (root / name).is_file():
            # a scenario.yaml is found by its folder, another configuration only by its name
            return root / name if name != _SCENARIO_FILES[0] else root
    scenarios = sorted(root.glob("*/scenario.yaml"))
    return scenarios[0].parent if len(scenarios) == 1 else None


def find_last_recording(root: Path) -> Path | None:
    """Return the newest recording in a folder or its subfolders; None if there is none."""
    recordings = [*root.glob("*.mcap"), *root.glob("*/*.mcap")]
    return max(recordings, key=lambda path: path.stat().st_mtime, default=None)


@lru_cache(maxsize=64)
def find_comment_above(text: str, offset: int) -> str:
    """Return the comment directly above an offset, without comment marks."""
    lines: list[str] = []
    for line in reversed(text[: text.rfind("\n", 0, offset) + 1].splitlines()):
        stripped_line = line.strip()
        if not stripped_line.startswith((";", "--", "#")):
            break
        lines.append(stripped_line.lstrip(";-# "))
    return "\n".join(reversed(lines)).strip()
