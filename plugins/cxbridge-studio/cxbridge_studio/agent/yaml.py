"""Reads the names in YAML configurations: specs, files, features, interfaces, actions, skills."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import Lines
from cxbridge.config.documents import Mark, YamlList, YamlMap, YamlNode, YamlScalar, parse_documents
from cxbridge.errors import ConfigError
from cxbridge_studio.agent.names import (
    Mention,
    Name,
    NameKind,
    SourceFile,
    Use,
    make_parse_problem,
    make_single_piece_file,
)

_STAGE: Final = re.compile(r"stage-\d+")
# The parts of a skill string in an action mapping, such as goto{place=?(to)S}: the skill, the arguments, and
# the action's parameters.
_SKILL: Final = re.compile(r"\b([A-Za-z_][\w-]*)\s*[{(]")
_ARGUMENT: Final = re.compile(r"[{,]\s*([A-Za-z_]\w*)\s*=")
_PLACEHOLDER: Final = re.compile(r"\?\(([A-Za-z0-9_-]+)")
# The next key in a later line, which ends a skill string of several lines.
_KEY: Final = re.compile(r"\n[ \t]*[\w-]+:(?=\s)")


def read_yaml(path: str, text: str) -> SourceFile:
    """Read a configuration. A file with invalid YAML has no names, only a problem."""
    try:
        documents = parse_documents(text, path)
    except ConfigError as error:
        return SourceFile(path, text, (), make_parse_problem(error))
    reader = _ConfigurationReader(text)
    for document in documents:
        reader.read_node(document, ())
    return make_single_piece_file(path, text, "configuration", None, reader.mentions)


class _ConfigurationReader:
    """Reads the documents of a file."""

    def __init__(self, text: str) -> None:
        self.mentions: list[Mention] = []
        self._text = text
        self._lines = Lines(text)

    def read_node(self, node: YamlNode, path: tuple[str, ...]) -> None:
        """Record the names in a node.

        :param path: the keys above the node, and in lists the indices of all items but scalars.
        """
        if isinstance(node, YamlMap):
            for key, value in node.pairs:
                if isinstance(key, YamlScalar):
                    keys = tuple(filter(None, key.text.split("/")))  # Fawkes' dialect: a key may be a path
                    self._record_key(key, value, (*path, *keys))
                    self.read_node(value, (*path, *keys))
        elif isinstance(node, YamlList):
            for index, item in enumerate(node.items):
                self.read_node(item, path if isinstance(item, YamlScalar) else (*path, str(index)))
        else:
            self._record_value(node, path)

    def _record_key(self, key: YamlScalar, value: YamlNode, path: tuple[str, ...]) -> None:
        """Record a key that is a name: a spec, or an action with its skill string."""
        match path:
            case ("clips-executive", "specs", _spec):
                self._record_name(NameKind.SPEC, key.mark, key.text, Use.DEFINED)
            case ("clips-executive", "specs", _spec, "action-mapping", action):
                self._record_name(NameKind.ACTION, key.mark, key.text, Use.NAMED)
                if isinstance(value, YamlScalar):
                    self._record_skill_string(value, action)

    def _record_value(self, value: YamlScalar, path: tuple[str, ...]) -> None:
        """Record a value that is a name: a spec, an interface, a file or a feature."""
        match path:
            case ("clips-executive", "spec"):
                kind = NameKind.SPEC
            case ("clips-executive", "specs", _spec, "blackboard-preload"):
                kind = NameKind.INTERFACE
            case ("clips-executive", "specs", _spec, "init", stage, _entry, "file" | "files") if (
                _STAGE.fullmatch(stage)
            ):
                kind = NameKind.FILE
            case ("clips-executive", "specs", _spec, "init", "stage-1", _entry, "name"):
                kind = NameKind.FEATURE
            case _:
                return
        self._record_name(kind, value.mark, value.text, Use.NAMED)

    def _record_skill_string(self, value: YamlScalar, action: str) -> None:
        """Record the skill, the arguments and the parameters in the skill string of an action.

        The search is in the text of the file, not in the value, because YAML's escapes and folded lines
        change offsets.
        """
        start = self._find_offset(value.mark)
        next_key_match = _KEY.search(self._text, start)
        end = next_key_match.start() if next_key_match else len(self._text)
        skill_match = _SKILL.search(self._text, start, end)
        skill = skill_match[1] if skill_match else value.text.strip()
        if skill_match:
            self.mentions.append(Mention(Name(NameKind.SKILL, skill), Use.CALLED, *skill_match.span(1)))
        self.mentions += [
            Mention(Name(kind, match[1], owner), use, *match.span(1))
            for kind, owner, use, pattern in (
                (NameKind.ARGUMENT, skill, Use.NAMED, _ARGUMENT),
                (NameKind.PARAMETER, action, Use.READ, _PLACEHOLDER),
            )
            for match in pattern.finditer(self._text, start, end)
        ]

    def _find_offset(self, mark: Mark) -> int:
        return self._lines.position(mark.line, mark.column)

    def _record_name(self, kind: NameKind, mark: Mark, text: str, use: Use) -> None:
        """Record a name, unless its spelling in the file differs, for example by escapes."""
        start = self._find_offset(mark)
        start += self._text.startswith(('"', "'"), start)  # after the opening quote, if there is one
        if kind is NameKind.FILE and "|" in text:  # BATCH|FILE: the file follows the bar
            start += text.index("|") + 1
            text = text.rpartition("|")[2]
        if self._text.startswith(text, start):
            self.mentions.append(Mention(Name(kind, text), use, start, start + len(text)))


def find_parent_keys(file: SourceFile, offset: int) -> Iterator[str]:
    """Yield the keys above the line of an offset, innermost first.

    Only the indentation counts, because the file is often not valid YAML while a user types.
    """
    rest_of_line = file.text[offset:].partition("\n")[0]
    *lines, last_line = (file.text[:offset] + rest_of_line).split("\n")
    # A line of blanks has the indentation of all its blanks: usually the cursor is at their end.
    indent = len(last_line) - len(last_line.lstrip(" ")) if last_line.strip() else len(last_line)
    for line in reversed(lines):
        match = re.match(r"( *)(?:- +)*([\w/-]+):", line)
        if match and (depth := match.start(2)) < indent:
            indent = depth
            yield match[2]
