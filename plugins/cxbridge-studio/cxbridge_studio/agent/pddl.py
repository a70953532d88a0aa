"""Reads the names in PDDL files: types, constants, predicates, and actions with their parameters.

The executive's parser gives up at the first mistake. This reader takes any section that has brackets, since
an editor shows names while a user types.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final

from msgspec.structs import replace

from cxbridge.clipstext.syntax import Lines
from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import Position
from cxbridge.executive.pddl.brackets import BracketWord, Group, Item, read_items
from cxbridge_studio.agent.names import (
    Mention,
    Name,
    NameKind,
    Piece,
    PlacedPiece,
    SourceFile,
    Use,
    parse_problem,
)

_ACTIONS: Final = frozenset({":action", ":durative-action"})
_CONNECTIVES: Final = frozenset(
    {"and", "or", "not", "imply", "forall", "exists", "when", "either", "increase", "decrease"}
    | {"assign", "scale-up", "scale-down", "=", "<", ">", "<=", ">=", "+", "-", "*", "/"}
)
_TYPED: Final = {
    ":types": NameKind.OBJECT_TYPE,
    ":constants": NameKind.CONSTANT,
    ":objects": NameKind.CONSTANT,
}
_TIMES: Final = (("at", "start"), ("at", "end"), ("over", "all"))
_SECTION: Final = re.compile(r"^[ \t]*(\(:[a-z-]+)", re.MULTILINE | re.IGNORECASE)
_COMMENT: Final = re.compile(r";[^\n]*")


def read_pddl(path: str, text: str) -> SourceFile:
    """Read a PDDL file; of a broken file, the sections that can be parsed."""
    try:
        items = read_items(text)
    except PddlError as error:
        return SourceFile(path, text, tuple(_as_declared(list(_broken(text)))), parse_problem(error))
    lines = Lines(text)
    sections = [
        (section, _offset(lines, section.position))
        for define in items
        if isinstance(define, Group)
        for section in define.items[1:]
        if isinstance(section, Group)
    ]
    ends = [*(start for _, start in sections[1:]), len(text)] if sections else []
    pieces = [_piece(section, text, start, end) for (section, start), end in zip(sections, ends, strict=True)]
    return SourceFile(path, text, tuple(_as_declared(pieces)))


def _as_declared(pieces: list[PlacedPiece]) -> Iterator[PlacedPiece]:
    """Yield pieces with each name in the spelling of its declaration: PDDL ignores case."""
    declared: dict[Name, str] = {}
    for _, piece in pieces:
        for mention in piece.mentions:
            if mention.use is Use.DEFINED:
                declared.setdefault(_lower(mention.name), mention.name.text)

    def renamed(mention: Mention) -> Mention:
        text = declared.get(_lower(mention.name), mention.name.text)
        if text == mention.name.text:
            return mention
        return replace(mention, name=mention.name._replace(text=text))

    for start, piece in pieces:
        yield PlacedPiece(start, replace(piece, mentions=tuple(map(renamed, piece.mentions))))


def _lower(name: Name) -> Name:
    return name._replace(text=name.text.lower())


def _broken(text: str) -> Iterator[PlacedPiece]:
    """Yield the sections of a text with unbalanced brackets; each is parsed alone."""
    starts = [match.start(1) for match in _SECTION.finditer(text)]
    for start, end in zip(starts, [*starts[1:], len(text)], strict=True):
        code = _COMMENT.sub(lambda match: " " * len(match[0]), text[start:end])
        missing = code.count("(") - code.count(")")
        # The last section has the bracket that closes the whole definition.
        while missing < 0 and (last := code.rfind(")")) >= 0:
            code = code[:last] + " " + code[last + 1 :]
            missing += 1
        try:
            items = read_items(code + ")" * missing)
        except PddlError:
            continue
        if items and isinstance(items[0], Group):
            yield _piece(items[0], text, start, end, Lines(code))


def _offset(lines: Lines, position: Position) -> int:
    return lines.place(position.line, position.column)


def _piece(section: Group, text: str, start: int, end: int, lines: Lines | None = None) -> PlacedPiece:
    """Return the piece of a section.

    :param lines: the lines of the section's text; None if positions refer to the whole file.
    """
    reader = _Section(Lines(text) if lines is None else lines, start if lines is None else 0)
    reader.read(section)
    mentions = tuple(sorted(reader.mentions, key=lambda mention: mention.start))
    # Blanks in place of comments keep the offsets.
    code = _COMMENT.sub(lambda match: " " * len(match[0]), text[start:end])
    defined_name = next((m.name for m in mentions if m.use is Use.DEFINED), None)
    has_name = section.head.lower() in (*_ACTIONS, "domain")
    return PlacedPiece(
        start,
        Piece(
            section.head,
            defined_name if has_name else None,
            text[start : start + len(code.rstrip())],
            mentions,
        ),
    )


class _Section:
    """Reader of one section.

    :param start: offset of the piece in the text that the positions refer to.
    """

    def __init__(self, lines: Lines, start: int) -> None:
        self.mentions: list[Mention] = []
        self._lines = lines
        self._start = start

    def read(self, section: Group) -> None:
        """Record the names of a section."""
        head, items = section.head.lower(), section.items[1:]
        if head in _ACTIONS:
            self._action(items)
        elif head in ("domain", ":domain"):
            self._words(items[:1], NameKind.DOMAIN, Use.DEFINED if head == "domain" else Use.NAMED)
        elif head in _TYPED:
            self._typed(items, _TYPED[head])
        elif head in (":predicates", ":functions"):
            for item in items:
                if isinstance(item, Group):
                    self._words(item.items[:1], NameKind.PREDICATE, Use.DEFINED)
                    self._typed(item.items[1:], None)
        elif head in (":init", ":goal"):
            for item in items:
                self._formula(item, "")

    def _action(self, items: tuple[Item, ...]) -> None:
        """Read ``NAME :parameters (...) :precondition (...) :effect (...)``."""
        if not items or not isinstance(items[0], BracketWord):
            return
        action = items[0].text
        self._words(items[:1], NameKind.ACTION, Use.DEFINED)
        key = ""
        for item in items[1:]:
            if isinstance(item, BracketWord) and item.text.startswith(":"):
                key = item.text.lower()
            elif key == ":parameters" and isinstance(item, Group):
                self._typed(item.items, NameKind.PARAMETER, action)
            else:
                self._formula(item, action)

    def _typed(self, items: Iterable[Item], kind: NameKind | None, owner: str = "") -> None:
        """Read ``a b - c``."""
        is_type = False
        for item in items:
            if isinstance(item, Group):
                self._words(item.items[1:], NameKind.OBJECT_TYPE, Use.NAMED)
            elif item.text == "-":
                is_type = True
                continue
            elif is_type:
                self._words((item,), NameKind.OBJECT_TYPE, Use.NAMED)
            elif kind is not None:
                self._words((item,), kind, Use.DEFINED, owner)
            is_type = False

    def _formula(self, item: Item, action: str) -> None:
        pending = [item]
        while pending:
            word = pending.pop()
            if isinstance(word, Group):
                pending += self._operands(word)
            elif word.text.startswith("?"):
                self._words((word,), NameKind.PARAMETER, Use.READ, action)
            elif not word.text[0].isdigit():
                self._words((word,), NameKind.CONSTANT, Use.NAMED)

    def _operands(self, group: Group) -> tuple[Item, ...]:
        """Record the predicate of a group and return the remaining items."""
        words = tuple(item.text.lower() for item in group.items[:2] if isinstance(item, BracketWord))
        if words in _TIMES:
            return group.items[2:]
        if not group.head:
            return group.items
        head = group.head.lower()
        if head not in _CONNECTIVES:
            self._words(group.items[:1], NameKind.PREDICATE, Use.NAMED)
        return group.items[2 if head in ("forall", "exists") else 1 :]

    def _words(self, items: Iterable[Item], kind: NameKind, use: Use, owner: str = "") -> None:
        for item in items:
            if isinstance(item, BracketWord):
                start = _offset(self._lines, item.position) - self._start
                end = start + len(item.text)
                name = Name(kind, item.text.removeprefix("?"), owner)
                self.mentions.append(Mention(name, use, start + item.text.startswith("?"), end))
