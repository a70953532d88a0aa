"""Names that differ between runs, and their replacements in a comparison.

Ids of ``gensym*`` (``gen12``), UUIDs and fact indices are names: a comparison replaces them by ``gen#``,
``uuid#`` and ``fact#``, and absolute times by ``time#``. docs/comparing.md, section "Names", has the rules.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Final, TypeAlias

from cxbridge.clock import MICROSECONDS
from cxbridge.trace.codec import dump_json

# The end of `oxygen5` is no id. The lookbehind follows `gen`, because the search for a fixed start is fast.
_GENSYM = re.compile(r"gen(?<![A-Za-z0-9]gen)\d+(?![A-Za-z0-9])")
_UUID = re.compile(r"(?<![0-9A-Za-z])[0-9a-fA-F]{8}(?:-[0-9a-fA-F]{4}){3}-[0-9a-fA-F]{12}(?![0-9A-Za-z])")
_UUID_HYPHENS = 4  # a text with fewer hyphens has no UUID
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

MAX_CACHED_TEXTS: Final = 20_000
"""The maximum number of texts with cached names. The events of a goal repeat their texts."""

PLACEHOLDER: Final = re.compile(r"(?:gen|uuid|fact)#")
"""The pattern of the text that replaces a name."""

Names: TypeAlias = tuple[int, ...]
"""The names in a text as numbers by first appearance in the run: gensym ids, UUIDs, then fact indices."""


def replace_names(text: str) -> str:
    """Replace all gensym ids in a text by ``gen#``, and all UUIDs by ``uuid#``."""
    return _extract_names(text, has_fact_names=False)[0]


def replace_fact_names(text: str) -> str:
    """Replace gensym ids, UUIDs, fact indices, message ids and absolute times in a text."""
    return _MSGID.sub("(msgid #)", _extract_names(text, has_fact_names=True)[0])


def interface_text(values: Mapping[str, Any]) -> str:
    """Return the values of an interface write as text, without the message id."""
    return dump_json({name: value for name, value in values.items() if name != MSGID})


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


@lru_cache(MAX_CACHED_TEXTS)
def _extract_names(text: str, *, has_fact_names: bool) -> tuple[str, tuple[str, ...]]:
    """Return a text with replaced names, and the names: gensym ids, then UUIDs, then fact indices.

    :param has_fact_names: whether fact indices are names, and absolute times are replaced.
    """
    text = replace_times(text) if has_fact_names else text
    names: list[str] = []
    # most texts have no names, which the first items show faster than the substitutions
    for may_match, pattern, placeholder in (
        ("gen" in text, _GENSYM, "gen#"),
        (text.count("-") >= _UUID_HYPHENS, _UUID, "uuid#"),
        (has_fact_names and any(start in text for start in _INDEX_STARTS), _INDEX, "fact#"),
    ):
        if may_match:
            names += pattern.findall(text)
            text = pattern.sub(placeholder, text)
    return text, tuple(names)


class Namer:
    """Separates the texts of a run from their names, which are numbered by first appearance."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def __len__(self) -> int:
        """Return the number of names so far."""
        return len(self._numbers)

    def split(self, text: str, *, has_fact_names: bool = False) -> tuple[str, Names]:
        """Return a text with its names replaced, and the numbers of the names.

        :param has_fact_names: whether fact indices are names, and absolute times are replaced.
        """
        template, names = _extract_names(text, has_fact_names=has_fact_names)
        numbers = self._numbers
        # most texts have no names
        return template, tuple([numbers.setdefault(name, len(numbers)) for name in names]) if names else ()
