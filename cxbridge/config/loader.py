"""Loading of files into one tree, with includes of files, folders and host-specific files.

As in Fawkes, files are laid over each other breadth first: the main file, its includes in order, their
includes, and last the host-specific file. Later files take precedence. Relative names are resolved in the
folder of the configuration, regardless of the including file.
"""

from __future__ import annotations

import os
import re
import socket
from collections import deque
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from msgspec import Struct

from cxbridge.config.documents import Mark, YamlList, YamlMap, YamlNode, YamlScalar, parse_documents
from cxbridge.config.tags import INCLUDE_TAGS, unknown_tag_error
from cxbridge.config.tree import ConfigNode, NodeKind, TreeBuilder, overlay
from cxbridge.errors import ConfigError

# a limit, because symbolic links can make an endless chain of folders whose files include the next folder;
# robots have fewer than a hundred files
MAX_FILES: Final = 1000
_FILE_IN_FOLDER: Final = re.compile(r"[a-zA-Z0-9_-]+\.yaml")


class _QueuedFile(Struct, frozen=True):
    """A file to read.

    :param mark: the place of the include; empty for a file that the program names.
    :param chain: the including files, from the first file to the file with the include.
    """

    path: Path
    mark: Mark
    chain: tuple[Path, ...] = ()
    ignores_missing: bool = False


class ConfigLoader:
    """Reads a configuration into ``root``.

    :param confdir: the base folder of relative includes.
    :param host: the text for ``$host`` in includes; by default the name of the machine.
    """

    def __init__(self, confdir: Path, host: str | None = None) -> None:
        self.root = ConfigNode(NodeKind.MAP, Mark())
        self.files: list[Path] = []
        self.host_includes: list[Path] = []
        """The includes with ``$host`` in the file name, not replaced."""
        self._confdir, self._host = confdir, host
        self._builder = TreeBuilder()
        self._host_file: _QueuedFile | None = None
        self._queue: deque[_QueuedFile] = deque()

    @property
    def warnings(self) -> list[str]:
        """Probable mistakes that are not errors, with their places."""
        return self._builder.warnings

    def load_files(self, files: Iterable[Path]) -> None:
        """Read files and their includes.

        :raises ConfigError: if a file cannot be read or is invalid.
        """
        self._queue.extend(_QueuedFile(file, Mark()) for file in files)
        self._load_queue()

    def load_text(self, text: str | bytes, name: str) -> None:
        """Read a text and its includes.

        :raises ConfigError: if the text is invalid, or an included file cannot be read or is invalid.
        """
        self._read(text, _QueuedFile(Path(name), Mark()), name)
        self._load_queue()

    def _load_queue(self) -> None:
        while self._queue:
            self._load_file(self._queue.popleft())
        if (host_file := self._host_file) is not None:  # last, so that its values take precedence
            self._load_file(host_file)
            if self._queue:
                raise ConfigError(
                    "a host-specific file may not include files",
                    file=host_file.path,
                    hint=f"move the include into the file that names it ({host_file.mark.file})",
                )

    def _load_file(self, queued_file: _QueuedFile) -> None:
        if len(self.files) >= MAX_FILES:
            raise queued_file.mark.error(f"more than {MAX_FILES} files are included")
        try:
            content = queued_file.path.read_bytes()
        except OSError as error:
            # a file that exists but cannot be read is an error all the same
            if queued_file.ignores_missing and isinstance(error, FileNotFoundError | NotADirectoryError):
                return
            raise _make_unreadable_error(queued_file, error) from None
        self.files.append(queued_file.path)
        self._read(content, queued_file, str(queued_file.path))

    def _read(self, content: str | bytes, queued_file: _QueuedFile, name: str) -> None:
        documents = parse_documents(content, name)
        for surplus in documents[2:3]:  # only the first, so that a file has one warning
            self.warnings.append(f"{surplus.mark.file}:{surplus.mark.line}: only two documents are read")
        if not documents:
            return
        *includes, values = documents[:2]  # a single document has the values
        for document in includes:
            self._queue_includes(document, queued_file)
        tree = self._builder.build(values)
        if tree.kind is NodeKind.MAP:
            overlay(self.root, tree)
        elif tree.kind is not NodeKind.NULL:  # null: the file has only comments
            raise tree.mark.error(
                f"the configuration must be a map of names to values, but this is {tree.kind.value}",
                "write 'name: value' lines",
            )

    def _queue_includes(self, document: YamlNode, queued_file: _QueuedFile) -> None:
        """Queue the includes in the first of two documents."""
        if isinstance(document, YamlScalar) and document.is_null:
            return
        if not isinstance(document, YamlMap):
            raise document.mark.error("the first of two documents must be a map, e.g. with 'include:'")
        for key, value in document.pairs:
            if isinstance(key, YamlScalar) and key.text == "include":
                self._queue_include_list(value, queued_file)

    def _queue_include_list(self, includes: YamlNode, queued_file: _QueuedFile) -> None:
        if isinstance(includes, YamlScalar) and includes.is_null:
            return
        if not isinstance(includes, YamlList):
            raise includes.mark.error(
                "'include' must be a list", "write each file on a separate line: '- FILE'"
            )
        for item in includes.items:
            if not isinstance(item, YamlScalar):
                raise item.mark.error(
                    "an include must be the name of a file, or of a folder with '/' at its end"
                )
            if item.tag and item.tag not in INCLUDE_TAGS:
                raise unknown_tag_error(item.tag, item.mark)
            # a NUL ends a name for the system, and Python would raise ValueError: such a name counts as empty
            if not item.text or item.is_null or "\0" in item.text:
                raise item.mark.error("the include is empty", "name a file or a folder")
            self._queue_include(item, queued_file)

    def _queue_include(self, item: YamlScalar, queued_file: _QueuedFile) -> None:
        if "$host" in Path(item.text).name:
            self.host_includes.append(Path(os.path.normpath(self._confdir / item.text)))
        name = item.text.replace("$host", self._host or socket.gethostname(), 1)
        path = Path(os.path.normpath(self._confdir / name))
        chain = (*queued_file.chain, queued_file.path)
        if item.tag == "host-specific":
            if self._host_file is not None:
                mark = self._host_file.mark
                raise item.mark.error(
                    f"a host-specific file is already included ({mark.file}:{mark.line})", "keep one"
                )
            self._host_file = _QueuedFile(path, item.mark, chain, ignores_missing=True)
            return
        is_optional = item.tag == "ignore-missing"
        if name.endswith("/"):
            self._queue_folder(path, item.mark, chain, is_optional=is_optional)
        else:
            self._queue_file(_QueuedFile(path, item.mark, chain, is_optional))

    def _queue_folder(self, folder: Path, mark: Mark, chain: tuple[Path, ...], *, is_optional: bool) -> None:
        try:
            files = list_config_files(folder)
        except OSError as error:
            if is_optional and isinstance(error, FileNotFoundError):
                return
            raise _make_unreadable_error(_QueuedFile(folder, mark), error) from None
        for file in files:
            self._queue_file(_QueuedFile(file, mark, chain, is_optional))

    def _queue_file(self, queued_file: _QueuedFile) -> None:
        if queued_file.path in queued_file.chain:
            cycle = " -> ".join(str(file) for file in (*queued_file.chain, queued_file.path))
            raise queued_file.mark.error(f"the includes form a cycle: {cycle}", "remove this include")
        self._queue.append(queued_file)


def list_config_files(folder: Path) -> list[Path]:
    """Return the configuration files of a folder, ``[a-zA-Z0-9_-]+.yaml``, sorted by name.

    :raises OSError: if the folder cannot be read.
    """
    return sorted(file for file in folder.iterdir() if _FILE_IN_FOLDER.fullmatch(file.name))


def _make_unreadable_error(queued_file: _QueuedFile, error: OSError) -> ConfigError:
    reason = (error.strerror or str(error)).lower()
    if not queued_file.mark.file:
        return ConfigError(f"cannot read the configuration: {reason}", file=queued_file.path)
    return queued_file.mark.error(
        f"cannot read the included {queued_file.path}: {reason}",
        "correct the name, or write '- !ignore-missing NAME' when it may be missing",
    )
