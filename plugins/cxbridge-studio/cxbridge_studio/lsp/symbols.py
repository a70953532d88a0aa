"""Document outline, workspace symbols and folding ranges."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import PARENTHESIS, blank
from cxbridge_studio.agent.model import FileMention
from cxbridge_studio.agent.names import Mention, NameKind, PlacedPiece, SourceFile, Use
from cxbridge_studio.agent.top_level import open_lists
from cxbridge_studio.lsp.session import Session

_PARTS: Final = frozenset(
    {NameKind.SLOT, NameKind.PARAMETER, NameKind.FIELD, NameKind.MESSAGE, NameKind.ARGUMENT}
)
_MOST: Final = 200  # symbols in the answer to a search


class OutlineSymbol(Struct, frozen=True):
    """An entry of an outline.

    :param mention: the defining mention.
    :param start: start of the definition.
    :param end: end of the definition.
    """

    mention: Mention
    start: int
    end: int
    parts: tuple[OutlineSymbol, ...] = ()


def outline(file: SourceFile) -> list[OutlineSymbol]:
    return [symbol for placed in file.pieces for symbol in _symbols(placed)]


def _symbols(placed: PlacedPiece) -> Iterator[OutlineSymbol]:
    defined = [mention for mention in placed.mentions if mention.use is Use.DEFINED]
    defined_mention = next((each for each in defined if each.name == placed.piece.name), None)
    if defined_mention is None:
        yield from (OutlineSymbol(each, each.start, each.end) for each in defined)
        return
    parts = tuple(
        OutlineSymbol(each, each.start, each.end) for each in defined if each is not defined_mention
    )
    yield OutlineSymbol(defined_mention, placed.start, placed.end, parts)


def find(session: Session, query: str) -> list[FileMention]:
    """Return the names in all files that contain the letters of a query in order."""
    lower_query = query.lower()
    symbols: list[FileMention] = []
    for file in session.model.files:
        for placed in file.pieces:
            for mention in placed.piece.defined:
                if mention.name.kind not in _PARTS and _matches(lower_query, mention.name.text.lower()):
                    symbols.append(FileMention(file, mention.moved(placed.start)))
                    if len(symbols) == _MOST:
                        return symbols
    return symbols


def _matches(lower_query: str, text: str) -> bool:
    letters = iter(text)
    return all(letter in letters for letter in lower_query)


def folds(file: SourceFile) -> list[tuple[int, int]]:
    """Return first and last line, from 1, of the lists and comments that span several lines."""
    lines = file.lines
    last_lines: dict[int, int] = {}
    if file.path.endswith((".clp", ".pddl")):
        for start, end in _lists(file):
            first, last = lines.at(start), lines.at(end)
            if last > first:
                last_lines.setdefault(first, last)
    first = 0
    for number, row in enumerate([*file.text.split("\n"), ""], 1):
        is_comment = row.startswith((";", "#", "--"))
        if is_comment and not first:
            first = number
        elif not is_comment and first:
            if number - 1 > first:
                last_lines.setdefault(first, number - 1)
            first = 0
    return sorted(last_lines.items())


def _lists(file: SourceFile) -> Iterator[tuple[int, int]]:
    """Yield the lists of a file. Constructs are parsed separately, so an unclosed one affects no other."""
    for start, piece in file.pieces:
        unclosed = set(open_lists(piece.text))
        opened: list[int] = []
        for match in PARENTHESIS.finditer(blank(piece.text)):
            if match[0] == "(":
                if match.start() not in unclosed:
                    opened.append(match.start())
            elif opened:
                yield start + opened.pop(), start + match.start()
