"""Reads the names in .proto files: messages by their full names, and their fields."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from cxbridge_studio.agent.names import Mention, Name, NameKind, SourceFile, Use, make_single_piece_file

# Comments, strings and white space are skipped, because they have no names. Numbers and punctuation count as
# words.
_TOKEN: Final = re.compile(
    r"""(?P<skipped>//[^\n]*|/\*.*?(?:\*/|\Z)|"(?:[^"\\\n]|\\.)*"?|'(?:[^'\\\n]|\\.)*'?|\s+)"""
    r"|(?P<word>[A-Za-z_][\w.]*|\d[\w.]*|.)",
    re.DOTALL,
)
# The keywords that may begin a block.
_BLOCK_KEYWORDS: Final = frozenset({"message", "enum", "oneof", "extend", "service", "group"})


def read_proto(path: str, text: str) -> SourceFile:
    """Read a .proto file. A broken file is read as far as possible."""
    word_matches = [match for match in _TOKEN.finditer(text) if match["word"]]
    mentions: list[Mention] = []
    package = ""
    blocks: list[_Block] = []  # the open blocks, outermost first
    statement_start = 0  # index of the statement's first word
    for index, match in enumerate(word_matches):
        mark = match["word"]
        if mark not in "{};":
            continue
        statement, statement_start = word_matches[statement_start:index], index + 1
        words = [match["word"] for match in statement]
        if mark == "}":
            if blocks:  # a broken file may have a surplus brace
                blocks.pop()
        elif mark == "{":
            keyword = next((word for word in words if word in _BLOCK_KEYWORDS), "")
            name_word = statement[-1] if statement else None
            message = blocks[-1].message if blocks else package
            if keyword == "message" and name_word is not None:
                message = ".".join(filter(None, (message, name_word["word"])))
                mentions.append(_make_definition(NameKind.PROTO_MESSAGE, message, "", name_word))
            blocks.append(_Block(keyword, message))
        elif words[:1] == ["package"] and len(words) > 1:
            package = words[1]
        # Only blocks with fields count: an enum also has statements NAME = NUMBER.
        elif blocks and blocks[-1].keyword in ("message", "oneof") and "=" in words[1:]:
            name_word = statement[words.index("=") - 1]
            if words[0] not in ("option", "reserved", "extensions"):
                mentions.append(
                    _make_definition(NameKind.PROTO_FIELD, name_word["word"], blocks[-1].message, name_word)
                )
    return make_single_piece_file(path, text, "proto", None, mentions)


class _Block(NamedTuple):
    """A block in braces.

    :param keyword: one of :data:`_BLOCK_KEYWORDS`, or empty.
    :param message: the full name of the innermost enclosing message, or the package outside of messages.
    """

    keyword: str
    message: str


def _make_definition(kind: NameKind, text: str, owner: str, word: re.Match[str]) -> Mention:
    return Mention(Name(kind, text, owner), Use.DEFINED, word.start(), word.end())
