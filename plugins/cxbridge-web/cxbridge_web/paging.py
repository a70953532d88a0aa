"""Lists in parts: what of them is wanted, and how many there are; docs/rest.md, Lists."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, Final

_MOST_DIGITS: Final = 15

MOST_COUNT: Final = 10**_MOST_DIGITS - 1
"""The highest number in a query."""

_NO_TEXTS: Final = frozenset({"kind", "apiVersion"})


class PagingError(ValueError):
    """An invalid parameter."""


@dataclass(frozen=True, slots=True)
class ListPart:
    """A part of a list.

    :param total: how many the whole list has.
    """

    items: Sequence[Any]
    total: int


@dataclass(frozen=True, slots=True)
class Window:
    """Which part of a list is wanted.

    :param limit: None: as many as there are.
    :param search: in small letters; empty: whatever they have.
    """

    offset: int = 0
    limit: int | None = None
    search: str = ""

    @classmethod
    def of(cls, query: Mapping[str, str]) -> Window:
        """Return the selection of a query.

        :raises PagingError: when a number is none.
        """
        return cls(_count(query, "offset") or 0, _count(query, "limit"), query.get("search", "").casefold())

    @property
    def range(self) -> tuple[int, int | None]:
        """Where it begins and ends; None: with the list."""
        return self.offset, None if self.limit is None else self.offset + self.limit

    def bounds(self, total: int) -> tuple[int, int]:
        """Return where the part of a list begins and ends that has ``total``, without a look at texts."""
        begin = min(self.offset, total)
        return begin, total if self.limit is None else min(begin + self.limit, total)

    def cut(self, models: Sequence[Any]) -> ListPart:
        """Return the part of all models."""
        found = [model for model in models if has_text(model, self.search)] if self.search else models
        begin, end = self.bounds(len(found))
        return ListPart(found[begin:end], len(found))


def _count(query: Mapping[str, str], name: str) -> int | None:
    text = query.get(name, "")
    if not text:
        return None
    if not (text.isascii() and text.isdecimal()) or len(text) > _MOST_DIGITS:
        raise PagingError(f"'{name}' must be a number, 0 or more")
    return int(text)


def has_text(model: Any, search: str) -> bool:
    """Whether any text of a model has ``search`` in it, in small letters or capitals."""
    if isinstance(model, str):
        return search in model.casefold()
    if isinstance(model, Mapping):
        return any(has_text(item, search) for name, item in model.items() if name not in _NO_TEXTS)
    if isinstance(model, Iterable):
        return any(has_text(item, search) for item in model)
    return False


def matches(name: str, pattern: str) -> bool:
    """Whether a name is that of a shell's pattern; of an empty one each is."""
    return not pattern or fnmatchcase(name, pattern)
