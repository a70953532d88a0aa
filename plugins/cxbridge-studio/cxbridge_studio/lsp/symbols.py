"""Finds the outline of a file, and symbols in all files."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Final

from msgspec import Struct

from cxbridge_studio.agent.model import FileMention
from cxbridge_studio.agent.names import Mention, NameKind, PlacedPiece, SourceFile, Use
from cxbridge_studio.lsp.session import Session

# the kinds of names within a definition; a search for symbols omits these names, since there are too many
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
    return [symbol for placed_piece in file.pieces for symbol in _make_piece_symbols(placed_piece)]


def _make_piece_symbols(placed_piece: PlacedPiece) -> Iterator[OutlineSymbol]:
    definitions = [mention for mention in placed_piece.mentions if mention.use is Use.DEFINED]
    main_mention = next((mention for mention in definitions if mention.name == placed_piece.piece.name), None)
    inner_symbols = tuple(
        OutlineSymbol(mention, mention.start, mention.end)
        for mention in definitions
        if mention is not main_mention
    )
    if main_mention is None:
        yield from inner_symbols
    else:
        yield OutlineSymbol(main_mention, placed_piece.start, placed_piece.end, inner_symbols)


def find_symbols(session: Session, query: str) -> list[FileMention]:
    """Return the first definitions of names that contain the letters of a query in order.

    Upper and lower case are equal. Names within a definition, such as slots, are omitted.
    """
    lower_query = query.lower()
    symbols = (
        FileMention(file, mention.shifted(placed_piece.start))
        for file in session.model.files
        for placed_piece in file.pieces
        for mention in placed_piece.piece.definitions
        if mention.name.kind not in _INNER_KINDS and _contains_letters(lower_query, mention.name.text.lower())
    )
    return list(islice(symbols, _MAX_RESULTS))


def _contains_letters(lower_query: str, text: str) -> bool:
    letters = iter(text)
    return all(letter in letters for letter in lower_query)  # `in` consumes the letters up to a match
