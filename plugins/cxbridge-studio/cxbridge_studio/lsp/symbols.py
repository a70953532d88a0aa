"""Finds the outline and the folding ranges of a file, and symbols in all files."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import PARENTHESIS, blank
from cxbridge_studio.agent.model import FileMention
from cxbridge_studio.agent.names import Mention, NameKind, PlacedPiece, SourceFile, Use
from cxbridge_studio.agent.top_level import find_open_lists
from cxbridge_studio.lsp.session import Session

# the kinds of names within a definition, which a search for symbols omits, since there are too many
_INNER_KINDS: Final = frozenset(
    {NameKind.SLOT, NameKind.PARAMETER, NameKind.FIELD, NameKind.MESSAGE, NameKind.ARGUMENT}
)
_MAX_RESULTS: Final = 200  # limit of the symbols in a result: a longer query finds further symbols


class OutlineSymbol(Struct, frozen=True):
    """An entry of an outline.

    :param mention: the mention of the name in its definition.
    :param start: the start of the definition.
    :param end: the end of the definition.
    :param children: the definitions within the definition, such as slots.
    """

    mention: Mention
    start: int
    end: int
    children: tuple[OutlineSymbol, ...] = ()


def make_outline(file: SourceFile) -> list[OutlineSymbol]:
    return [symbol for placed in file.pieces for symbol in _make_piece_symbols(placed)]


def _make_piece_symbols(placed: PlacedPiece) -> Iterator[OutlineSymbol]:
    definitions = [mention for mention in placed.mentions if mention.use is Use.DEFINED]
    main_mention = next((mention for mention in definitions if mention.name == placed.piece.name), None)
    inner_symbols = tuple(
        OutlineSymbol(mention, mention.start, mention.end)
        for mention in definitions
        if mention is not main_mention
    )
    if main_mention is None:
        yield from inner_symbols
    else:
        yield OutlineSymbol(main_mention, placed.start, placed.end, inner_symbols)


def find_symbols(session: Session, query: str) -> list[FileMention]:
    """Return the first definitions of names that contain the letters of a query in order."""
    lower_query = query.lower()
    symbols = (
        FileMention(file, mention.shifted(placed.start))
        for file in session.model.files
        for placed in file.pieces
        for mention in placed.piece.definitions
        if mention.name.kind not in _INNER_KINDS and _contains_letters(lower_query, mention.name.text.lower())
    )
    return list(islice(symbols, _MAX_RESULTS))


def _contains_letters(lower_query: str, text: str) -> bool:
    letters = iter(text)
    return all(letter in letters for letter in lower_query)  # `in` consumes the letters before a match


def find_folding_ranges(file: SourceFile) -> list[tuple[int, int]]:
    """Return the first and the last line, from 1, of each list and comment that spans several lines."""
    ranges: list[tuple[int, int]] = []
    if file.path.endswith((".clp", ".pddl")):
        ranges += [(file.lines.at(start), file.lines.at(end)) for start, end in _find_list_offsets(file)]
    comment_start = 0
    for number, line in enumerate([*file.text.split("\n"), ""], 1):
        is_comment = line.startswith((";", "#", "--"))
        if is_comment and not comment_start:
            comment_start = number
        elif not is_comment and comment_start:
            ranges.append((comment_start, number - 1))
            comment_start = 0
    last_lines: dict[int, int] = {}
    for first, last in ranges:  # the first range of a line counts: editors accept only one
        if last > first:
            last_lines.setdefault(first, last)
    return sorted(last_lines.items())


def _find_list_offsets(file: SourceFile) -> Iterator[tuple[int, int]]:
    """Yield the offsets of the two parentheses of each list in a file.

    Each construct is parsed alone, so that an unclosed construct does not affect further constructs.
    """
    for start, piece in file.pieces:
        unclosed_starts = set(find_open_lists(piece.text))
        open_starts: list[int] = []
        for match in PARENTHESIS.finditer(blank(piece.text)):
            if match[0] == "(":
                if match.start() not in unclosed_starts:
                    open_starts.append(match.start())
            elif open_starts:
                yield start + open_starts.pop(), start + match.start()
