"""Replacements as C++'s ``std::regex_replace`` makes them, which Fawkes' action mapping uses.

The patterns are those of :mod:`re`, which agree with ``std::regex`` (ECMAScript) except for POSIX classes and
rare escapes.
"""

from __future__ import annotations

import re
from functools import lru_cache

# $$, $&, or the number of a group
_REFERENCE = re.compile(r"\$(?:([$&])|([0-9]{1,2}))")


class PatternError(ValueError):
    """The text is not a supported regular expression."""


@lru_cache(maxsize=256)  # chosen freely: far more patterns than usual action mappings have
def compile_pattern(pattern: str) -> re.Pattern[str]:
    """Compile an expression, ignoring the case of ASCII letters.

    :raises PatternError: if the expression is invalid, or contains ``[:``, the start of a POSIX class.
    """
    if "[:" in pattern:
        raise PatternError("POSIX classes such as [:digit:] are not supported")
    try:
        return re.compile(pattern, re.IGNORECASE | re.ASCII)
    except (re.error, OverflowError) as error:
        raise PatternError(str(error)) from None


def replace_all(pattern: str, replacement: str, value: str) -> str:
    """Replace every match of ``pattern`` in ``value``.

    :param replacement: may contain ``$$``, ``$&``, and ``$1`` to ``$99``. A missing group is empty.
    :raises PatternError: as :func:`compile_pattern`.
    """

    def expand(match: re.Match[str]) -> str:
        def referenced_text(reference: re.Match[str]) -> str:
            sign, number = reference.groups()
            if number is None:
                return "$" if sign == "$" else match[0]
            return (match[int(number)] or "") if int(number) <= match.re.groups else ""

        return _REFERENCE.sub(referenced_text, replacement)

    return compile_pattern(pattern).sub(expand, value)
