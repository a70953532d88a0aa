"""Parts of lists: the requested range and the total; see docs/rest.md, Lists."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, Final

from cxbridge.numbers import parse_decimal

_MAX_DIGITS: Final = 15  # numbers of 15 digits are exact in JavaScript

MAX_COUNT: Final = 10**_MAX_DIGITS - 1  # largest number in a query

# All models of a list share these members, so a search in them would find either all models or none.
_UNSEARCHED_MEMBERS: Final = frozenset({"kind", "apiVersion"})


class PagingError(ValueError):
    """An invalid query parameter."""


@dataclass(frozen=True, slots=True)
class ListPart:
    """A part of a list.

    :param total: the length of the whole list.
    """

    items: Sequence[Any]
    total: int


@dataclass(frozen=True, slots=True)
class Window:
    """The requested part of a list.

    :param limit: None for no limit.
    :param search: a case-folded text; empty to select all items.
    """

    offset: int = 0
    limit: int | None = None
    search: str = ""

    @classmethod
    def from_query(cls, query: Mapping[str, str]) -> Window:
        """Parse the query parameters.

        :raises PagingError: if a number is invalid.
        """
        return cls(
            _parse_count(query, "offset") or 0,
            _parse_count(query, "limit"),
            query.get("search", "").casefold(),
        )

    @property
    def requested_bounds(self) -> tuple[int, int | None]:
        """The start and the end of the part; an end of None is the end of the list."""
        return self.offset, None if self.limit is None else self.offset + self.limit

    def find_bounds_within(self, total: int) -> tuple[int, int]:
        """Return the start and the end of the part in a list of length ``total``, ignoring the search."""
        begin = min(self.offset, total)
        return begin, total if self.limit is None else min(begin + self.limit, total)

    def select(self, models: Sequence[Any]) -> ListPart:
        """Return the requested part of the models that the search matches."""
        matching_models = (
            [model for model in models if has_text(model, self.search)] if self.search else models
        )
        begin, end = self.find_bounds_within(len(matching_models))
        return ListPart(matching_models[begin:end], len(matching_models))


def _parse_count(query: Mapping[str, str], name: str) -> int | None:
    """Return a number of the query; None if the query lacks the parameter."""
    text = query.get(name, "")
    if not text:
        return None
    count = parse_decimal(text, _MAX_DIGITS)
    if count is None:
        raise PagingError(f"'{name}' must be a whole number from 0 to {MAX_COUNT}")
    return count


def has_text(model: Any, search: str) -> bool:
    """Return whether any text of a model contains ``search``, a case-folded text."""
    if isinstance(model, str):
        return search in model.casefold()
    if isinstance(model, Mapping):
        return any(has_text(item, search) for name, item in model.items() if name not in _UNSEARCHED_MEMBERS)
    if isinstance(model, Iterable):
        return any(has_text(item, search) for item in model)
    return False


def matches(name: str, pattern: str) -> bool:
    """Return whether a name matches a shell pattern; an empty pattern matches all names."""
    return not pattern or fnmatchcase(name, pattern)
