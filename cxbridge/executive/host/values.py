"""Conversion between CLIPS and Python values.

==================  =====================================
CLIPS               Python
==================  =====================================
INTEGER, FLOAT      int, float
STRING              str
SYMBOL              :class:`Symbol` (a str)
MULTIFIELD          tuple
FACT-ADDRESS        :class:`FactAddress`
INSTANCE-NAME       :class:`InstanceName` (a str)
INSTANCE-ADDRESS    :class:`InstanceAddress`
EXTERNAL-ADDRESS    :class:`ExternalAddress`
void                None
==================  =====================================

A list becomes a multifield, too, and a bool the symbol TRUE or FALSE.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from clips._clips import ffi, lib
from msgspec import Struct

from cxbridge.clipstext.values import (
    FALSE,
    NIL,
    TRUE,
    InstanceName,
    Symbol,
    Value,
    float_text,
    value_text,
)
from cxbridge.errors import ClipsError
from cxbridge.executive.host.capi import CData, decode, encode

__all__ = [
    "FALSE",
    "NIL",
    "TO_PYTHON",
    "TRUE",
    "ExternalAddress",
    "FactAddress",
    "InstanceAddress",
    "InstanceName",
    "Symbol",
    "Value",
    "clips_value",
    "print_value",
    "to_python",
    "value_pointer",
    "value_text",
]

_INT64_MAX = 2**63 - 1  # the integers of CLIPS have 64 bits


class FactAddress(Struct, frozen=True):
    """A fact, valid only during the call that received it.

    :param pointer: ``Fact *``.
    """

    pointer: CData

    def __str__(self) -> str:
        return f"<Fact-{lib.FactIndex(self.pointer)}>"


class InstanceAddress(Struct, frozen=True):
    """An instance of COOL, valid as long as the instance exists.

    :param pointer: ``Instance *``.
    """

    pointer: CData

    def __str__(self) -> str:
        return f"<Instance-{decode(lib.InstanceName(self.pointer))}>"


class ExternalAddress(Struct, frozen=True):
    """A handle of a Python object, e.g. a message.

    :param handle: the number of the object, which the owner of the object assigns; 0: no object.
    """

    handle: int


def _multifield_values(value: CData) -> tuple[Value, ...]:
    # a UDFValue may hold a part of a multifield, from begin; a CLIPSValue holds the whole multifield
    contents, first = value.multifieldValue.contents, getattr(value, "begin", 0)
    count = getattr(value, "range", value.multifieldValue.length)
    return tuple(to_python(contents + index) for index in range(first, first + count))


TO_PYTHON: tuple[Callable[[CData], Value], ...] = (
    lambda value: value.floatValue.contents,
    lambda value: value.integerValue.contents,
    # the most frequent types, without the overhead of decode()
    lambda value: Symbol(ffi.string(value.lexemeValue.contents), "utf-8", "surrogateescape"),
    lambda value: ffi.string(value.lexemeValue.contents).decode("utf-8", "surrogateescape"),
    _multifield_values,
    lambda value: ExternalAddress(int(ffi.cast("intptr_t", value.externalAddressValue.contents))),
    lambda value: FactAddress(value.factValue),
    lambda value: InstanceAddress(value.instanceValue),
    lambda value: InstanceName(decode(value.lexemeValue.contents)),
    lambda _value: None,
)
"""Converters of values to Python by CLIPS' type code.

The codes 0 to 9 are float, integer, symbol, string, multifield, external address, fact address, instance
address, instance name, void.
"""


def to_python(value: CData) -> Value:
    """Convert a ``CLIPSValue *`` or ``UDFValue *``."""
    return TO_PYTHON[value.header.type](value)


def _make_integer(env: CData, value: int) -> CData:
    if not -_INT64_MAX - 1 <= value <= _INT64_MAX:
        raise ClipsError(f"{value} does not fit into an INTEGER of CLIPS (64 bits)")
    return lib.CreateInteger(env, value)


def _make_multifield(env: CData, values: tuple[Value, ...] | list[Value]) -> CData:
    if not values:
        return lib.EmptyMultifield(env)
    builder = lib.CreateMultifieldBuilder(env, len(values))
    element = ffi.new("CLIPSValue *")
    for value in values:
        element.value = value_pointer(env, value)
        lib.MBAppend(builder, element)
    multifield = lib.MBCreate(builder)
    lib.MBDispose(builder)
    return multifield


_TO_CLIPS: dict[type, Callable[[CData, Any], CData]] = {
    int: _make_integer,
    float: lib.CreateFloat,
    bool: lib.CreateBoolean,
    str: lambda env, value: lib.CreateString(env, encode(value)),
    Symbol: lambda env, value: lib.CreateSymbol(env, encode(value)),
    tuple: _make_multifield,
    list: _make_multifield,
    FactAddress: lambda _env, value: value.pointer,
    InstanceName: lambda env, value: lib.CreateInstanceName(env, encode(value)),
    InstanceAddress: lambda _env, value: value.pointer,
    ExternalAddress: lambda env, value: lib.CreateCExternalAddress(env, ffi.cast("void *", value.handle)),
    type(None): lambda env, _value: lib.VoidConstant(env),
}


def value_pointer(env: CData, value: Value) -> CData:
    """Return the C value (``void *``) of a Python value.

    :raises ClipsError: if CLIPS has no equivalent.
    """
    try:
        convert = _TO_CLIPS[type(value)]
    except KeyError:
        raise ClipsError(f"CLIPS has no equivalent of {value!r}") from None
    return convert(env, value)


def clips_value(env: CData, value: Value) -> CData:
    """Return a Python value as a ``CLIPSValue *``, valid until CLIPS' next garbage collection."""
    result = ffi.new("CLIPSValue *")
    result.value = value_pointer(env, value)
    return result


def _print_fields(value: CData) -> str:
    contents = value.multifieldValue.contents
    return " ".join([print_value(contents + index) for index in range(value.multifieldValue.length)])


# Printers of the frequent types by CLIPS' type code, like :data:`TO_PYTHON`. They are faster than a
# conversion to Python. CLIPS prints strings without escaping the quotes within them.
_PRINTERS: tuple[Callable[[CData], str], ...] = (
    lambda value: float_text(value.floatValue.contents),
    lambda value: str(value.integerValue.contents),
    lambda value: decode(value.lexemeValue.contents),
    lambda value: f'"{decode(value.lexemeValue.contents)}"',
    _print_fields,
)


def print_value(value: CData) -> str:
    """Return the text of a ``CLIPSValue *``, as CLIPS prints it within a fact."""
    type_code = value.header.type
    return _PRINTERS[type_code](value) if type_code < len(_PRINTERS) else value_text(to_python(value))
