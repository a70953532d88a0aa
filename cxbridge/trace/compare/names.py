"""Names that differ between runs, and their replacements in a comparison.

Ids of ``gensym*`` (``gen12``), UUIDs, fact indices and absolute times do not characterize a run. The rules
are in docs/comparing.md, section "Names".
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final, TypeAlias

from cxbridge.clock import MICROSECONDS
from cxbridge.trace.codec import dump, plain_values

# without a lookbehind the search is fast; the preceding character is checked separately
_GENSYM = re.compile(r"gen\d+(?![A-Za-z0-9])")
_UUID = re.compile(r"(?<![0-9A-Za-z])[0-9a-fA-F]{8}(?:-[0-9a-fA-F]{4}){3}-[0-9a-fA-F]{12}(?![0-9A-Za-z])")
_UUID_WITHIN = re.compile(r"-[0-9a-fA-F]{4}-[0-9a-fA-F]{4}-")
_INDEX = re.compile(r"(?<=<Fact-)\d+(?=>)|(?<=-idx )[1-9]\d*(?=\))|(?<=\(meta-fact )[1-9]\d*(?=\))")
_INDEX_WITHIN = ("-idx ", "(meta-fact ", "<Fact-")
_TIMES = re.compile(r"(?<![\w.-])[1-9]\d{9}(?:\.\d+|[ ,]+(?:INTEGER )?\d{1,6})?(?![\w.-])")
_PAIR = re.compile(r"(?<![\w.-])(\d{1,9}) \d{1,6}(?![\w.-])")  # seconds and microseconds
_DATED_US = 10**9 * MICROSECONDS
_RECENT_S = 3600  # numbers within the last hour of the run count as times
_TIME_WITHIN = re.compile(r"\d{10}")
_MSGID = re.compile(r"\(msgid (\d{1,18})\)")

MSGID: Final = "msgid"
"""The field or slot with the id of the message that a writer took last."""

MAX_CACHED: Final = 50_000
"""The number of cached texts at which the cache is cleared."""

Names: TypeAlias = tuple[int, ...]
"""The names in a text, in order, as numbers by first appearance in the run."""


def anonymous(text: str) -> str:
    """Replace all gensym ids in a text by one name, and all UUIDs by another."""
    return _split(text, [])


def anonymous_fact(text: str) -> str:
    """Replace gensym ids, UUIDs, fact indices, message ids and times in a text by one name each."""
    return _MSGID.sub("(msgid #)", _split(without_times(text), [], indices=True))


def interface_text(values: Mapping[str, Any]) -> str:
    """Return the values of an interface write as text, without the message id."""
    return dump({name: value for name, value in plain_values(values).items() if name != MSGID})


def take_msgid(text: str) -> tuple[str, int | None]:
    """Return the text of a fact without its message id, and the id or None."""
    match = _MSGID.search(text) if MSGID in text else None
    if match is None:
        return text, None
    return f"{text[: match.start()]}(msgid #){text[match.end() :]}", int(match.group(1))


def without_times(text: str) -> str:
    """Replace all absolute times in a text."""
    return text if _TIME_WITHIN.search(text) is None else _TIMES.sub("time#", text)


def without_times_of_day(text: str, now_us: int) -> str:
    """Replace seconds since midnight in a text of a log without dates.

    :param now_us: the run's clock; the text of a run with dates is unchanged.
    """
    # the times of a log without dates count from midnight of 1970-01-01
    if now_us >= _DATED_US or _PAIR.search(text) is None:
        return text

    def replacement(match: re.Match[str]) -> str:
        return "time#" if 0 <= now_us // MICROSECONDS - int(match[1]) <= _RECENT_S else match[0]

    return _PAIR.sub(replacement, text)


def _split(text: str, names: list[str], *, indices: bool = False) -> str:
    """Replace the names in a text by one name for each kind, and append the names to a list.

    The names are in this order: gensym ids, UUIDs, fact indices.

    :param indices: whether fact indices are names.
    """

    def gensym(match: re.Match[str]) -> str:
        start = match.start()
        # `oxygen5` is a word
        if start and match.string[start - 1].isalnum() and match.string[start - 1].isascii():
            return match.group()
        names.append(match.group())
        return "gen#"

    def uuid(match: re.Match[str]) -> str:
        names.append(match.group())
        return "uuid#"

    def index(match: re.Match[str]) -> str:
        names.append(f"f-{match.group()}")
        return "fact#"

    # most texts have no names: these searches exclude them faster than the expressions
    if "gen" in text:
        text = _GENSYM.sub(gensym, text)
    if _UUID_WITHIN.search(text) is not None:
        text = _UUID.sub(uuid, text)
    if indices and any(part in text for part in _INDEX_WITHIN):
        text = _INDEX.sub(index, text)
    return text


class Namer:
    """Separates the texts of a run from their names, which are numbered by first appearance."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}
        self._cache: dict[tuple[str, bool], tuple[str, Names]] = {}

    def __len__(self) -> int:
        """Return the number of names so far."""
        return len(self._numbers)

    def split(self, text: str, *, is_fact: bool = False) -> tuple[str, Names]:
        """Return a text with its names replaced, and the numbers of the names.

        :param is_fact: whether fact indices are names, and absolute times are replaced.
        """
        key = (text, is_fact)
        result = self._cache.get(key)
        if result is None:
            if len(self._cache) >= MAX_CACHED:
                self._cache.clear()
            names: list[str] = []
            template = _split(without_times(text) if is_fact else text, names, indices=is_fact)
            numbers = self._numbers
            result = template, tuple(numbers.setdefault(name, len(numbers)) for name in names)
            self._cache[key] = result
        return result
