"""Values of CLIPS, independent of the CLIPS library, and their printed forms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain, repeat
from math import copysign, isnan
from typing import Any, Final, TypeAlias

from msgspec import Struct


class Symbol(str):
    """A SYMBOL; plain str is a STRING."""

    __slots__ = ()


class InstanceName(str):
    """The name of an instance of COOL, without brackets."""

    __slots__ = ()


class FactRef(Struct, frozen=True):
    """A fact address that remains valid after the retraction: the fact's index."""

    index: int

    def __str__(self) -> str:
        return f"<Fact-{self.index}>"


TRUE: Final = Symbol("TRUE")
FALSE: Final = Symbol("FALSE")
NIL: Final = Symbol("nil")

Value: TypeAlias = Any
"""A value: int, float, str, a class of this module, or of :mod:`cxbridge.executive.host.values`.

A tuple of values is a MULTIFIELD. An exact recursive alias would cost more casts than it would find mistakes.
"""


def float_text(value: float) -> str:
    """Return a FLOAT as CLIPS prints it: 15 digits, always with a point or an exponent.

    Source: ``FloatToString`` of CLIPS, 6.30 and 6.4.
    """
    # Python omits the sign of NaN, which C prints
    sign = "-" if isnan(value) and copysign(1, value) < 0 else ""
    text = f"{sign}{value:.15g}"
    return text if "." in text or "e" in text else text + ".0"


def value_text(value: Value) -> str:
    """Return a value as CLIPS prints it within a fact: strings in quotes, fields separated by blanks.

    Nothing is escaped, as in CLIPS; :func:`quoted` is for text that CLIPS reads.
    """
    printer = _PRINTERS.get(type(value))
    return str(value) if printer is None else printer(value)


_PRINTERS: Final[dict[type, Callable[[Any], str]]] = {
    str: lambda value: f'"{value}"',
    InstanceName: lambda value: f"[{value}]",
    tuple: lambda value: " ".join(map(value_text, value)),
    list: lambda value: " ".join(map(value_text, value)),
    float: float_text,
}


def lone_value_text(value: Value) -> str:
    """Return a value as CLIPS prints it outside of a fact: a MULTIFIELD in parentheses."""
    return f"({value_text(value)})" if isinstance(value, tuple) else value_text(value)


def quoted(text: str) -> str:
    """Return a STRING in CLIPS source text."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


NO_CONSTANT: Final = "nil"
"""The text in place of a constant, for a term of a predicate that is a parameter."""


def constants_of(names: Sequence[str], constants: Sequence[str]) -> list[str | None]:
    """Return the constant of each term of a predicate, None for a term that is a parameter.

    :param names: the slot ``param-names``, which has a name for each term.
    :param constants: the slot ``param-constants``, in which trailing parameters may be missing.
    """
    padded_constants = chain(constants, repeat(NO_CONSTANT))
    return [
        None if constant == NO_CONSTANT else constant
        for constant, _ in zip(padded_constants, names, strict=False)
    ]
