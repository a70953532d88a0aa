"""The terms of a predicate as the facts of a domain hold them: names of parameters, and constants."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, repeat
from typing import Final

NO_CONSTANT: Final = "nil"
"""The constant of a term that is a parameter."""


def constants_of(names: Sequence[str], constants: Sequence[str]) -> list[str | None]:
    """Return the constant of each term, None for a term that is a parameter.

    :param names: the slot ``param-names``.
    :param constants: the slot ``param-constants``; terms behind its end are parameters.
    """
    filled = chain(constants, repeat(NO_CONSTANT))
    return [None if each == NO_CONSTANT else each for each, _ in zip(filled, names, strict=False)]
