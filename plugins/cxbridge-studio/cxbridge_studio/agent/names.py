"""The names of an agent: their kinds, their places, and their uses."""

from __future__ import annotations

from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

from msgspec import Struct

from cxbridge.clipstext.syntax import Lines


class NameKind(StrEnum):
    """The kind of a name."""

    RULE = "rule"
    TEMPLATE = "template"
    SLOT = "slot"
    FUNCTION = "function"
    GLOBAL = "global"
    FACTS = "facts"
    CLASS = "class"
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
    PROTO_MESSAGE = "protobuf message"
    PROTO_FIELD = "protobuf field"
    FEATURE = "feature"
    FILE = "file"
    SPEC = "spec"


class Use(StrEnum):
    """The use of a name at a place."""

    DEFINED = "defined"
    MATCHED = "matched"
    """In a pattern of a rule."""
    ASSERTED = "asserted"
    """In an ``assert`` or a deffacts."""
    CHANGED = "changed"
    """In a ``modify`` or a ``duplicate``."""
    QUERIED = "queried"
    """In ``do-for-all-facts`` and its like, or as ``?fact:slot``."""
    CALLED = "called"
    READ = "read"
    SET = "set"
    NAMED = "named"
    """Anywhere else."""


class Name(NamedTuple):
    """A name.

    :param owner: its owner: the template of a slot, the action of a parameter, the interface of a
        interface; empty where that is not known, or there is none.
    """

    kind: NameKind
    text: str
    owner: str = ""


class Mention(Struct, frozen=True, gc=False):
    """A place where a name is written.

    The garbage collector passes it over: an agent has tens of thousands, and none is part of a cycle.

    :param start: offset of its first character; in a :class:`Piece` counted from the start of that.
    :param end: offset behind its last.
    """

    name: Name
    use: Use
    start: int
    end: int

    def moved(self, offset: int) -> Mention:
        """Return the same mention, moved by an offset."""
        return Mention(self.name, self.use, self.start + offset, self.end + offset)


class Piece(Struct, frozen=True, dict=True):
    """A construct of a file, or something else that is read as a whole.

    Nothing in it depends on where it is in the file, so that it is read again only when it changes.

    :param keyword: ``defrule``, ``:action``, ``skill``; the first word of a command.
    :param name: the defined name; None when there is none, or none yet.
    :param text: the source text.
    :param mentions: the names in it, in the order of the text.
    :param closed: whether its parentheses close.
    """

    keyword: str
    name: Name | None
    text: str
    mentions: tuple[Mention, ...]
    closed: bool = True

    @cached_property
    def asserted_slots(self) -> dict[str, list[Mention]]:
        """The mentions of slots of asserted facts, by the slots' names.

        Of a fact whose template is undefined, these are calls of functions: ``(assert (total (+ 1 2)))``.
        """
        found: dict[str, list[Mention]] = {}
        for mention in self.mentions:
            if mention.name.kind is NameKind.SLOT and mention.use is Use.ASSERTED:
                found.setdefault(mention.name.text, []).append(mention)
        return found

    @cached_property
    def defined(self) -> tuple[Mention, ...]:
        """The mentions that define a name."""
        return tuple(mention for mention in self.mentions if mention.use is Use.DEFINED)


class ParseProblem(Struct, frozen=True):
    """Why a file could not be read as a whole.

    :param line: from 1, as ``column``.
    """

    message: str
    line: int = 1
    column: int = 1
    hint: str = ""


class PlacedPiece(NamedTuple):
    """A piece, and the offset in its file where it begins."""

    start: int
    piece: Piece

    @property
    def end(self) -> int:
        """The offset behind its last character."""
        return self.start + len(self.piece.text)

    @property
    def mentions(self) -> tuple[Mention, ...]:
        """Its mentions, with offsets in the file."""
        return tuple(mention.moved(self.start) for mention in self.piece.mentions)


class SourceFile(Struct, frozen=True, dict=True):
    """A file of an agent, as far as it can be read.

    :param path: absolute.
    :param problem: why the rest of it cannot be read.
    """

    path: str
    text: str
    pieces: tuple[PlacedPiece, ...]
    problem: ParseProblem | None = None

    @cached_property
    def lines(self) -> Lines:
        """Its lines."""
        return Lines(self.text)

    @cached_property
    def by_name(self) -> dict[Name, list[tuple[int, Mention]]]:
        """The mentions by their names, each with the start of its piece."""
        found: dict[Name, list[tuple[int, Mention]]] = {}
        for start, piece in self.pieces:
            for mention in piece.mentions:
                found.setdefault(mention.name, []).append((start, mention))
        return found

    @property
    def mentions(self) -> tuple[Mention, ...]:
        """All names in it, with offsets in the file."""
        return tuple(mention for placed in self.pieces for mention in placed.mentions)

    def piece_at(self, offset: int) -> PlacedPiece | None:
        """Return the piece that a place is in, or ends at."""
        found = None
        for placed in self.pieces:
            if placed.start > offset:
                break
            found = placed
        return found if found is not None and offset <= found.end else None

    def mention_at(self, offset: int) -> Mention | None:
        """Return the name that a place is in, or right behind."""
        placed = self.piece_at(offset)
        if placed is None:
            return None
        at = offset - placed.start
        found = [mention for mention in placed.piece.mentions if mention.start <= at <= mention.end]
        # the shortest: the cursor means the name within another name
        best = min(found, key=lambda mention: mention.end - mention.start, default=None)
        return None if best is None else best.moved(placed.start)
