"""Names that differ between runs, and their replacements in a comparison.

Ids of ``gensym*`` (``gen12``), UUIDs and fact indices are names: a comparison replaces them by ``gen#``,
``uuid#`` and ``fact#``, and absolute times by ``time#``. docs/comparing.md, section "Names", has the rules.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final, TypeAlias

from cxbridge.clock import MICROSECONDS
from cxbridge.trace.codec import dump_json, values_with_enum_names

# Without a lookbehind the search is fast: `_extract_names` checks the preceding character.
_GENSYM = re.compile(r"gen\d+(?![A-Za-z0-9])")
_UUID = re.compile(r"(?<![0-9A-Za-z])[0-9a-fA-F]{8}(?:-[0-9a-fA-F]{4}){3}-[0-9a-fA-F]{12}(?![0-9A-Za-z])")
# A part of a UUID that is found faster than the whole.
_UUID_MIDDLE = re.compile(r"-[0-9a-fA-F]{4}-[0-9a-fA-F]{4}-")
# The indices of facts: `<Fact-12>`, and those in the slots of the core, `(...-idx 12)` and `(meta-fact 12)`.
_INDEX = re.compile(r"(?<=<Fact-)\d+(?=>)|(?<=-idx )[1-9]\d*(?=\))|(?<=\(meta-fact )[1-9]\d*(?=\))")
_INDEX_STARTS = ("-idx ", "(meta-fact ", "<Fact-")
# Seconds since the epoch, alone, with a fraction, or followed by microseconds as in slots of facts.
_TIMES = re.compile(r"(?<![\w.-])[1-9]\d{9}(?:\.\d+|[ ,]+(?:INTEGER )?\d{1,6})?(?![\w.-])")
# Seconds since midnight, followed by microseconds as in slots of facts.
_SECONDS_AND_MICROSECONDS = re.compile(r"(?<![\w.-])(\d{1,9}) \d{1,6}(?![\w.-])")
_MIN_DATED_US = 10**9 * MICROSECONDS  # in 2001: earlier times are times of day in a log without dates
_MAX_AGE_S = 3600  # in a log without dates, numbers within the last hour count as times
_TEN_DIGITS = re.compile(r"\d{10}")
_MSGID = re.compile(r"\(msgid (\d{1,18})\)")

MSGID: Final = "msgid"
"""The field or slot with the id of the message that the writer of an interface processed last."""

MAX_CACHED_TEXTS: Final = 50_000
"""The number of cached texts at which the cache is cleared."""

Names: TypeAlias = tuple[int, ...]
"""The names in a text, in order, as numbers by first appearance in the run."""


def replace_names(text: str) -> str:
    """Replace all gensym ids in a text by ``gen#``, and all UUIDs by ``uuid#``."""
    return _extract_names(text, [])


def replace_fact_names(text: str) -> str:
    """Replace gensym ids, UUIDs, fact indices, message ids and absolute times in a text."""
    return _MSGID.sub("(msgid #)", _extract_names(replace_times(text), [], indices=True))


def interface_text(values: Mapping[str, Any]) -> str:
    """Return the values of an interface write as text, without the message id."""
    return dump_json({name: value for name, value in values_with_enum_names(values).items() if name != MSGID})


def split_msgid(text: str) -> tuple[str, int | None]:
    """Return the text of a fact with a replaced message id, and the id or None."""
    match = _MSGID.search(text) if MSGID in text else None
    if match is None:
        return text, None
    return f"{text[: match.start()]}(msgid #){text[match.end() :]}", int(match.group(1))


def replace_times(text: str) -> str:
    """Replace all absolute times in a text by ``time#``."""
    return text if _TEN_DIGITS.search(text) is None else _TIMES.sub("time#", text)


def replace_times_of_day(text: str, now_us: int) -> str:
    """Replace seconds since midnight in a text of a log without dates.

    :param now_us: the run's clock; the text of a run with dates is unchanged.
    """
    # the times of a log without dates count from midnight of 1970-01-01
    if now_us >= _MIN_DATED_US or _SECONDS_AND_MICROSECONDS.search(text) is None:
        return text

    def replacement(match: re.Match[str]) -> str:
        return "time#" if 0 <= now_us // MICROSECONDS - int(match[1]) <= _MAX_AGE_S else match[0]

    return _SECONDS_AND_MICROSECONDS.sub(replacement, text)


def _extract_names(text: str, names: list[str], *, indices: bool = False) -> str:
    """Replace the names in a text, and append the names to a list: gensym ids, then UUIDs, then fact indices.

    :param indices: whether fact indices are names.
    """

    def replace_gensym(match: re.Match[str]) -> str:
        start = match.start()
        # the end of `oxygen5` is no id
        if start and match.string[start - 1].isalnum() and match.string[start - 1].isascii():
            return match.group()
        names.append(match.group())
        return "gen#"

    def replace_uuid(match: re.Match[str]) -> str:
        names.append(match.group())
        return "uuid#"

    def replace_index(match: re.Match[str]) -> str:
        names.append(f"f-{match.group()}")
        return "fact#"

    # most texts have no names, which these searches show faster than the substitutions
    if "gen" in text:
        text = _GENSYM.sub(replace_gensym, text)
    if _UUID_MIDDLE.search(text) is not None:
        text = _UUID.sub(replace_uuid, text)
    if indices and any(part in text for part in _INDEX_STARTS):
        text = _INDEX.sub(replace_index, text)
    return text


class Namer:
    """Separates the texts of a run from their names, which are numbered by first appearance."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}
        self._cache: dict[tuple[str, bool], tuple[str, Names]] = {}  # the results of `split` by its arguments

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
            if len(self._cache) >= MAX_CACHED_TEXTS:
                self._cache.clear()
            names: list[str] = []
            template = _extract_names(replace_times(text) if is_fact else text, names, indices=is_fact)
            numbers = self._numbers
            result = template, tuple(numbers.setdefault(name, len(numbers)) for name in names)
            self._cache[key] = result
        return result
