"""The types of an agent's model: names with their kinds, uses and positions, and the files that have them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

from msgspec import Struct

from cxbridge.clipstext.syntax import Lines
from cxbridge.errors import CxbridgeError


class NameKind(StrEnum):
    """The kind of a named thing; the values appear in messages to users."""

    RULE = "rule"
    TEMPLATE = "template"
    SLOT = "slot"
    FUNCTION = "function"
    GLOBAL = "global"
    FACTS = "facts"
    MODULE = "module"
    GOAL_CLASS = "goal class"
    DOMAIN = "domain"
    ACTION = "action"
    PARAMETER = "parameter"
    PREDICATE = "predicate"
    OBJECT_TYPE = "object type"
    CONSTANT = "constant"
    SKILL = "skill"
    ARGUMENT = "argument"
    INTERFACE = "interface"
    FIELD = "field"
    MESSAGE = "message"
    FEATURE = "feature"
    FILE = "file"
    SPEC = "spec"


class Use(StrEnum):
    """The use of a name at a position."""

    DEFINED = "defined"
    MATCHED = "matched"  # in a pattern of a rule
    ASSERTED = "asserted"  # in `assert` or `deffacts`
    CHANGED = "changed"  # in `modify` or `duplicate`
    QUERIED = "queried"  # in a query such as `do-for-all-facts`, or as `?fact:slot`
    CALLED = "called"
    READ = "read"
    SET = "set"
    NAMED = "named"  # in any other way


class Name(NamedTuple):
    """A name in the files of an agent.

    :param owner: the template of a slot, the action of a PDDL parameter, the skill of an argument, or the
        interface of a field or message; empty for other kinds, and if the owner is unknown.
    """

    kind: NameKind
    text: str
    owner: str = ""


class Mention(Struct, frozen=True, gc=False):
    """A position where a name is written.

    Mentions opt out of garbage collection (``gc=False``): an agent has tens of thousands, and no mention is
    part of a cycle.

    :param start: the offset of the first character; in a :class:`Piece`, relative to the start of the piece.
    :param end: the offset after the last character.
    """

    name: Name
    use: Use
    start: int
    end: int

    def shifted(self, offset: int) -> Mention:
        """Return the mention with its offsets moved by the start of its piece."""
        return Mention(self.name, self.use, self.start + offset, self.end + offset)


class Piece(Struct, frozen=True, dict=True):
    """A construct of a file, or another unit that is read as a whole.

    A piece does not contain its position in the file, so that a change elsewhere in the file leaves the piece
    valid.

    :param keyword: the first word of a construct, section or command, such as ``defrule`` or ``:action``, and
        empty if the list has none; the sort of file, such as ``skill``, if the file is read as a whole.
    :param name: the name of the piece itself; None if it has none. A piece without a name may define names,
        as ``defglobal`` does.
    :param text: the source text.
    :param mentions: the names in the piece, in the order of the text.
    :param is_closed: whether all parentheses of the piece are closed.
    """

    keyword: str
    name: Name | None
    text: str
    mentions: tuple[Mention, ...]
    is_closed: bool = True

    @cached_property
    def asserted_slots(self) -> dict[str, list[Mention]]:
        """The mentions of slots in asserted facts, by the name of the slot.

        If no file defines the template, the fact is ordered, and the apparent slots are calls of functions:
        ``(assert (total (+ 1 2)))``.
        """
        slots: dict[str, list[Mention]] = {}
        for mention in self.mentions:
            if mention.name.kind is NameKind.SLOT and mention.use is Use.ASSERTED:
                slots.setdefault(mention.name.text, []).append(mention)
        return slots

    @cached_property
    def definitions(self) -> tuple[Mention, ...]:
        return tuple(mention for mention in self.mentions if mention.use is Use.DEFINED)


class ParseProblem(Struct, frozen=True):
    """A syntax error, because of which a file has no names, or only those of its readable parts.

    :param line: the line of the error, from 1.
    :param column: the column of the error, from 1.
    """

    message: str
    line: int = 1
    column: int = 1
    hint: str = ""


class PlacedPiece(NamedTuple):
    """A piece and its offset in the file."""

    start: int
    piece: Piece

    @property
    def end(self) -> int:
        """The offset after the last character."""
        return self.start + len(self.piece.text)

    @property
    def mentions(self) -> tuple[Mention, ...]:
        """The mentions of the piece, with offsets in the file."""
        return tuple(mention.shifted(self.start) for mention in self.piece.mentions)


class SourceFile(Struct, frozen=True, dict=True):
    """A file of an agent, as far as it can be read.

    :param path: the path of the file, which identifies the file in a model.
    :param problem: the syntax error that the reader reports; None if there is none.
    """

    path: str
    text: str
    pieces: tuple[PlacedPiece, ...]
    problem: ParseProblem | None = None

    @cached_property
    def lines(self) -> Lines:
        return Lines(self.text)

    @cached_property
    def mentions_by_name(self) -> dict[Name, list[tuple[int, Mention]]]:
        """The mentions by name, each with the start of its piece, since offsets count from there."""
        mentions_by_name: dict[Name, list[tuple[int, Mention]]] = {}
        for start, piece in self.pieces:
            for mention in piece.mentions:
                mentions_by_name.setdefault(mention.name, []).append((start, mention))
        return mentions_by_name

    @property
    def mentions(self) -> tuple[Mention, ...]:
        return tuple(mention for placed_piece in self.pieces for mention in placed_piece.mentions)

    def piece_at(self, offset: int) -> PlacedPiece | None:
        """Return the piece that contains an offset or ends there; None if there is none."""
        index = bisect_right(self.pieces, offset, key=lambda placed_piece: placed_piece.start) - 1
        return self.pieces[index] if index >= 0 and offset <= self.pieces[index].end else None

    def mention_at(self, offset: int) -> Mention | None:
        """Return the mention that contains an offset or ends there; None if there is none."""
        placed_piece = self.piece_at(offset)
        if placed_piece is None:
            return None
        candidates = (mention for mention in placed_piece.mentions if mention.start <= offset <= mention.end)
        # If mentions overlap, the user means the shortest under the cursor: `f`, not `m.f`.
        return min(candidates, key=lambda mention: mention.end - mention.start, default=None)


def make_parse_problem(error: CxbridgeError) -> ParseProblem:
    """Return the error of a reader as a problem of the file; without a position, at the start of the file."""
    return ParseProblem(error.message, error.line or 1, error.column or 1, error.hint or "")


def make_single_piece_file(
    path: str, text: str, keyword: str, name: Name | None, mentions: Iterable[Mention]
) -> SourceFile:
    """Return a file with a single piece, for formats that are read as a whole.

    :param keyword: the keyword of the piece, such as ``skill``.
    :param name: the name that the file defines; None if the file defines none.
    """
    ordered_mentions = tuple(sorted(mentions, key=lambda mention: mention.start))
    return SourceFile(path, text, (PlacedPiece(0, Piece(keyword, name, text, ordered_mentions)),))
