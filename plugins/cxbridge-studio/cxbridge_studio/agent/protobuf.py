"""Reads the names in .proto files: messages by their full names, and their fields."""

from __future__ import annotations

import re
from typing import Final

from cxbridge_studio.agent.names import Mention, Name, NameKind, SourceFile, Use, file_of_one_piece

_WORD: Final = re.compile(
    r"""(?P<hidden>//[^\n]*|/\*.*?(?:\*/|\Z)|"(?:[^"\\\n]|\\.)*"?|'(?:[^'\\\n]|\\.)*'?|\s+)"""
    r"|(?P<word>[A-Za-z_][\w.]*|\d[\w.]*|.)",
    re.DOTALL,
)
_SCOPES: Final = frozenset({"message", "enum", "oneof", "extend", "service", "group"})


def read_proto(path: str, text: str) -> SourceFile:
    """Read a .proto file; a broken file is read as far as possible."""
    words = [match for match in _WORD.finditer(text) if match["word"]]
    mentions: list[Mention] = []
    package = ""
    scopes: list[tuple[str, str]] = []  # open blocks: keyword, and full name of the enclosing message
    statement_start = 0  # index of the statement's first word
    for index, match in enumerate(words):
        word = match["word"]
        if word not in "{};":
            continue
        statement, statement_start = words[statement_start:index], index + 1
        heads = [match["word"] for match in statement]
        if word == "}":
            if scopes:
                scopes.pop()
        elif word == "{":
            kind = next((head for head in heads if head in _SCOPES), "")
            name = statement[-1] if statement else None
            outer = scopes[-1][1] if scopes else package
            full = outer
            if kind == "message" and name is not None:
                full = ".".join(filter(None, (outer, name["word"])))
                mentions.append(_defined(NameKind.PROTO_MESSAGE, full, "", name))
            scopes.append((kind, full))
        elif heads[:1] == ["package"] and len(heads) > 1:
            package = heads[1]
        elif scopes and scopes[-1][0] in ("message", "oneof") and "=" in heads[1:]:
            name = statement[heads.index("=") - 1]
            if heads[0] not in ("option", "reserved", "extensions"):
                mentions.append(_defined(NameKind.PROTO_FIELD, name["word"], scopes[-1][1], name))
    return file_of_one_piece(path, text, "proto", None, mentions)


def _defined(kind: NameKind, text: str, owner: str, word: re.Match[str]) -> Mention:
    return Mention(Name(kind, text, owner), Use.DEFINED, word.start(), word.end())
