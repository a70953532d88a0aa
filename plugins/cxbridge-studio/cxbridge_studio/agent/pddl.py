"""Reads the names in PDDL files: types, constants, predicates, and actions with their parameters.

The executive's parser stops at the first mistake. In a broken file, this reader reads each section alone, and
adds the brackets that the section lacks, because an editor shows names while a user types.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Final

from msgspec.structs import replace

from cxbridge.clipstext.syntax import Lines
from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import ARITHMETIC, FORMULA_WORDS, QUANTIFIER_WORDS, TIME_WORDS, Position
from cxbridge.executive.pddl.brackets import BracketWord, Group, Item, read_items
from cxbridge_studio.agent.names import (
    Mention,
    Name,
    NameKind,
    Piece,
    PlacedPiece,
    SourceFile,
    Use,
    make_parse_problem,
)

_ACTION_HEADS: Final = frozenset({":action", ":durative-action"})
# The first words of formulas, terms and types in brackets that are not predicates.
_NON_PREDICATES: Final = ARITHMETIC.union(FORMULA_WORDS, ("either",))
# Sections that are typed lists, with the kind of the names that they define.
_TYPED_SECTIONS: Final = {
    ":types": NameKind.OBJECT_TYPE,
    ":constants": NameKind.CONSTANT,
    ":objects": NameKind.CONSTANT,
}
# By convention, a section of a domain or problem begins its line, which shows the sections of a broken file.
_SECTION: Final = re.compile(r"^[ \t]*(\(:[a-z-]+)", re.MULTILINE | re.IGNORECASE)
_COMMENT: Final = re.compile(r";[^\n]*")


def read_pddl(path: str, text: str) -> SourceFile:
    """Read a PDDL file. In a broken file, only sections that can be parsed alone have names."""
    try:
        items = read_items(text)
    except PddlError as error:
        return SourceFile(
            path,
            text,
            tuple(_restore_declared_case(list(_find_parsable_sections(text)))),
            make_parse_problem(error),
        )
    lines = Lines(text)
    sections = [
        section
        for define in items
        if isinstance(define, Group)
        for section in define.items[1:]
        if isinstance(section, Group)
    ]
    bounds = pairwise([*(_find_offset(lines, section.position) for section in sections), len(text)])
    pieces = [
        _read_piece(section, text, start, end) for section, (start, end) in zip(sections, bounds, strict=True)
    ]
    return SourceFile(path, text, tuple(_restore_declared_case(pieces)))


def _restore_declared_case(pieces: list[PlacedPiece]) -> Iterator[PlacedPiece]:
    """Yield the pieces with each declared name in the case of its declaration, because PDDL ignores case."""
    declared_names = {
        _lower_name(mention.name): mention.name
        for _, piece in reversed(pieces)  # the first declaration of a name counts
        for mention in reversed(piece.definitions)
    }

    def restore_case(mention: Mention) -> Mention:
        return replace(mention, name=declared_names.get(_lower_name(mention.name), mention.name))

    for start, piece in pieces:
        yield PlacedPiece(start, replace(piece, mentions=tuple(map(restore_case, piece.mentions))))


def _lower_name(name: Name) -> Name:
    return name._replace(text=name.text.lower())


def _find_parsable_sections(text: str) -> Iterator[PlacedPiece]:
    """Yield the sections that can be parsed alone in a broken text."""
    for start, end in pairwise([*(match.start(1) for match in _SECTION.finditer(text)), len(text)]):
        code = _blank_comments(text[start:end])
        missing_count = code.count("(") - code.count(")")
        # The last section also contains the bracket that closes the whole definition.
        while missing_count < 0 and (bracket := code.rfind(")")) >= 0:
            code = code[:bracket] + " " + code[bracket + 1 :]
            missing_count += 1
        try:
            items = read_items(code + ")" * missing_count)
        except PddlError:  # the section has another mistake
            continue
        if items and isinstance(items[0], Group):
            yield _read_piece(items[0], text, start, end, Lines(code))


def _blank_comments(text: str) -> str:
    """Return a text with blanks in place of the comments, so that offsets stay the same."""
    return _COMMENT.sub(lambda match: " " * len(match[0]), text)


def _find_offset(lines: Lines, position: Position) -> int:
    return lines.position(position.line, position.column)


def _read_piece(section: Group, text: str, start: int, end: int, lines: Lines | None = None) -> PlacedPiece:
    """Return the piece of a section.

    :param text: the text of the whole file.
    :param start: the offset of the section.
    :param end: the offset of the next section, or the end of the text.
    :param lines: the lines of the section's text; None if the positions refer to the whole file.
    """
    reader = _SectionReader(Lines(text) if lines is None else lines, start if lines is None else 0)
    reader.read_section(section)
    mentions = tuple(sorted(reader.mentions, key=lambda mention: mention.start))
    code = _blank_comments(text[start:end])
    defined_name = next((mention.name for mention in mentions if mention.use is Use.DEFINED), None)
    # Other sections, such as `:types`, define names, but have none.
    has_name = section.head.lower() in (*_ACTION_HEADS, "domain")
    return PlacedPiece(
        start,
        Piece(
            section.head,
            defined_name if has_name else None,
            text[start : start + len(code.rstrip())],
            mentions,
        ),
    )


class _SectionReader:
    """Reads one section.

    :param lines: the lines of the text to which the positions of the section refer.
    :param start: the offset of the section in that text.
    """

    def __init__(self, lines: Lines, start: int) -> None:
        self.mentions: list[Mention] = []
        self._lines = lines
        self._start = start

    def read_section(self, section: Group) -> None:
        """Record the names of a section."""
        head, items = section.head.lower(), section.items[1:]
        if head in _ACTION_HEADS:
            self._read_action(items)
        elif head in ("domain", ":domain"):
            self._record_words(items[:1], NameKind.DOMAIN, Use.DEFINED if head == "domain" else Use.NAMED)
        elif head in _TYPED_SECTIONS:
            self._read_typed_list(items, _TYPED_SECTIONS[head])
        elif head in (":predicates", ":functions"):
            for item in items:
                if isinstance(item, Group):
                    self._record_words(item.items[:1], NameKind.PREDICATE, Use.DEFINED)
                    self._read_typed_list(item.items[1:], None)
        elif head in (":init", ":goal"):
            for item in items:
                self._read_formula(item, "")

    def _read_action(self, items: tuple[Item, ...]) -> None:
        """Read ``NAME :parameters (...) :precondition (...) :effect (...)``."""
        if not items or not isinstance(items[0], BracketWord):
            return
        action = items[0].text
        self._record_words(items[:1], NameKind.ACTION, Use.DEFINED)
        key = ""
        for item in items[1:]:
            if isinstance(item, BracketWord) and item.text.startswith(":"):
                key = item.text.lower()
            elif key == ":parameters" and isinstance(item, Group):
                self._read_typed_list(item.items, NameKind.PARAMETER, action)
            else:
                self._read_formula(item, action)

    def _read_typed_list(self, items: Iterable[Item], kind: NameKind | None, owner: str = "") -> None:
        """Read ``a b - TYPE``, or ``a b - (either TYPE...)``.

        :param kind: the kind of the names that the list defines; None if only the types are names.
        :param owner: the action whose parameters the list defines; empty for other lists.
        """
        is_type = False
        for item in items:
            if isinstance(item, Group):
                self._record_words(item.items[1:], NameKind.OBJECT_TYPE, Use.NAMED)
            elif item.text == "-":
                is_type = True
                continue
            elif is_type:
                self._record_words((item,), NameKind.OBJECT_TYPE, Use.NAMED)
            elif kind is not None:
                self._record_words((item,), kind, Use.DEFINED, owner)
            is_type = False

    def _read_formula(self, item: Item, action: str) -> None:
        """Record the names in a formula.

        :param action: the action that owns the formula's parameters; empty outside of actions.
        """
        # A loop instead of recursion: formulas may be nested deeper than Python's stack.
        pending_items = [item]
        while pending_items:
            inner_item = pending_items.pop()
            if isinstance(inner_item, Group):
                pending_items += self._read_operands(inner_item)
            elif inner_item.text.startswith("?"):
                self._record_words((inner_item,), NameKind.PARAMETER, Use.READ, action)
            elif not inner_item.text.lstrip("-.")[:1].isdigit():  # not a number such as 2, -2 or .5
                self._record_words((inner_item,), NameKind.CONSTANT, Use.NAMED)

    def _read_operands(self, group: Group) -> tuple[Item, ...]:
        """Record the predicate of a group and return the remaining items."""
        words = tuple(item.text.lower() for item in group.items[:2] if isinstance(item, BracketWord))
        if words in TIME_WORDS:
            return group.items[2:]
        if not group.head:  # an empty group, or a list of groups
            return group.items
        head = group.head.lower()
        if head not in _NON_PREDICATES:
            self._record_words(group.items[:1], NameKind.PREDICATE, Use.NAMED)
        # The second item of a quantified formula declares its variables.
        return group.items[2 if head in QUANTIFIER_WORDS else 1 :]

    def _record_words(self, items: Iterable[Item], kind: NameKind, use: Use, owner: str = "") -> None:
        """Record the words among the items as names. The question mark is not part of a parameter's name."""
        for item in items:
            if isinstance(item, BracketWord):
                start = _find_offset(self._lines, item.position) - self._start
                end = start + len(item.text)
                name = Name(kind, item.text.removeprefix("?"), owner)
                self.mentions.append(Mention(name, use, start + item.text.startswith("?"), end))
