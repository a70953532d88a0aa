"""Regular expressions of queries: PCRE2 in UTF-8, as in MongoDB, with a bound on what one may cost.

Python's `re` reads another language (``(?<name>...)``, POSIX classes, what a letter is), and has no bound.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from bson import Regex

from cxbridge.executive.robmem.errors import QueryError

_LIMIT = "(*LIMIT_MATCH=1000000)"
"""Steps of one match; 20 ms or so."""

_LETTERS = {re.IGNORECASE: "i", re.MULTILINE: "m", re.DOTALL: "s", re.VERBOSE: "x"}


def letters(flags: int) -> str:
    """Return the options that BSON has with a regular expression, as letters.

    :raises QueryError: when MongoDB does not know one.
    """
    if flags & re.LOCALE:
        raise QueryError("regular expressions have no option 'l'", hint="known are i, m, s and x")
    return "".join(letter for flag, letter in _LETTERS.items() if flags & flag)


def compile_regex(pattern: Any, options: str) -> Callable[[Any], bool]:
    """Return what says whether a value fits: a text with a match in it, or the same regular expression.

    :param options: letters of ``imsx``.
    :raises QueryError: when it is none; what is returned raises it when a match takes too many steps.
    """
    # a library in C, for the few queries that have one
    import pcre2  # noqa: PLC0415

    if not isinstance(pattern, str) or "\0" in pattern:
        raise QueryError("a regular expression is a text without NUL")
    flags = pcre2.ASCII
    for letter in options:
        if letter not in "imsx":
            raise QueryError(f"regular expressions have no option '{letter}'", hint="known are i, m, s and x")
        flags |= getattr(pcre2, letter.upper())
    try:
        compiled = pcre2.compile(_LIMIT + pattern, flags)
    except (pcre2.error, pcre2.LibraryError) as error:
        raise QueryError(f"not a regular expression: {pattern}: {str(error).rpartition('; ')[2]}") from None

    def test(value: Any) -> bool:
        if isinstance(value, str):
            try:
                return compiled.search(value) is not None
            except pcre2.LibraryError as error:
                raise QueryError(f"regular expression '{pattern}': {error}") from None
        return (
            isinstance(value, Regex)
            and value.pattern == pattern
            and set(letters(value.flags)) == set(options)
        )

    return test
