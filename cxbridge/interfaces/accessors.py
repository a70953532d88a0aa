"""Properties that read and write single fields of a block.

Reading a number or a text uses a :mod:`ctypes` view of the block, which is the fastest access of the standard
library; reading an array and all writing use :mod:`struct`, which checks type and range. The accessors of
numbers and texts are compiled from templates with the number of the field, which makes them fast: ``f0``,
``f1`` ... are the names in the view. Names of a definition never become source text.

As in Fawkes, a setter sets ``_changed`` if the stored value changes, and ``_refreshed`` always. A setter that
refuses a value leaves the field unchanged.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from enum import IntEnum
from functools import lru_cache
from operator import attrgetter
from struct import Struct
from struct import error as StructError  # noqa: N812 - it is an exception class
from typing import Any, Protocol, TypeVar, overload

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.schema import FieldSchema

T = TypeVar("T")
Getter = Callable[[Any], Any]
Setter = Callable[[Any, Any], None]


class Array(Protocol[T]):
    """The static type of an array field, which reads as a tuple and takes any sequence."""

    @overload
    def __get__(self, block: None, owner: type) -> Array[T]: ...
    @overload
    def __get__(self, block: object, owner: type) -> tuple[T, ...]: ...

    def __set__(self, block: object, value: Sequence[T]) -> None: ...


def make_accessor(owner: str, field: FieldSchema, slot: int, enum: type[IntEnum] | None) -> property:
    """Return the property of a field.

    :param owner: the name of the interface or message, for error messages.
    :param slot: the number of the field in the view, 0 for ``f0``.
    :param enum: the class of the values of an enum field; None for other fields.
    """
    if field.is_string:
        accessors = _make_string_accessors(owner, field, slot)
    elif field.is_array:
        accessors = _make_array_accessors(owner, field, enum)
    else:
        accessors = _make_scalar_accessors(owner, field, slot, enum)
    return property(*accessors, doc=field.comment or None)


def misfit_error(owner: str, field: FieldSchema, value: object) -> InterfaceError:
    """Return the error for a value that a field cannot hold."""
    allowed = field.storage.allowed_values
    if field.enum is not None:
        names = ", ".join(item.name for item in field.enum.items)
        allowed = f"one of {names}"
    if field.is_array:
        allowed = f"a sequence of at most {field.length} elements, each {allowed}"
    quoted_value = repr(value)
    if len(quoted_value) > _MAX_QUOTED_CHARACTERS:
        quoted_value = quoted_value[: _MAX_QUOTED_CHARACTERS - len("...")] + "..."
    return InterfaceError(
        f"{owner}.{field.name} of type {field.type} cannot be {quoted_value}", hint=f"it holds {allowed}"
    )


def _make_scalar_accessors(
    owner: str, field: FieldSchema, slot: int, enum: type[IntEnum] | None
) -> tuple[Getter, Setter]:
    """Return the accessors of a number, bool or enum value."""

    def adapt(value: object) -> object:
        """Return the number of an enum item's name; raise the error for any other value."""
        number = getattr(enum, value, None) if enum is not None and isinstance(value, str) else None
        if not isinstance(number, int):
            raise misfit_error(owner, field, value)
        return number

    if enum is None:
        getter: Getter = attrgetter(f"_view.f{slot}")
    else:
        getter = _compile_template(_ENUM_GETTER_TEMPLATE, slot)({item.value: item for item in enum}.get)
    source = _BOOL_SETTER_TEMPLATE if field.storage.python_type is bool else _NUMBER_SETTER_TEMPLATE
    setter = _compile_template(source, slot)(Struct("=" + field.storage.code).pack_into, field.offset, adapt)
    return getter, setter


def _make_string_accessors(owner: str, field: FieldSchema, slot: int) -> tuple[Getter, Setter]:
    room = field.text_room
    layout = Struct(f"={room}s{field.size - room}x")  # pads the text, and the NUL after it, with zeros

    def adapt(value: object) -> bytes:
        """Return a text as bytes, cut to the room; raise the error for any other value."""
        if not isinstance(value, str):
            raise misfit_error(owner, field, value)
        try:
            return fit_text(value, room)
        except UnicodeEncodeError:
            raise misfit_error(owner, field, value) from None

    getter = _compile_template(_STRING_GETTER_TEMPLATE, slot)()
    return getter, _compile_template(_STRING_SETTER_TEMPLATE, slot)(
        layout.pack_into, field.offset, room, adapt
    )


def _make_array_accessors(
    owner: str, field: FieldSchema, enum: type[IntEnum] | None
) -> tuple[Getter, Setter]:
    layout = Struct(f"={field.length}{field.storage.code}")
    unpack_from, offset = layout.unpack_from, field.offset

    def get(self: Any) -> tuple[Any, ...]:
        return unpack_from(self._buf, offset)

    getter = get if enum is None else _make_enum_array_getter(layout, offset, enum)
    return getter, _make_array_setter(owner, field, layout, enum)


def _make_enum_array_getter(layout: Struct, offset: int, enum: type[IntEnum]) -> Getter:
    """Return a getter that converts numbers to enum items."""
    unpack_from = layout.unpack_from
    items = {item.value: item for item in enum}

    def get(self: Any) -> tuple[Any, ...]:
        numbers = unpack_from(self._buf, offset)
        # a number without an item stays a number, as in Fawkes
        return tuple(map(items.get, numbers, numbers))

    return get


def _make_array_setter(owner: str, field: FieldSchema, layout: Struct, enum: type[IntEnum] | None) -> Setter:
    """Return a setter for sequences; missing elements become zero."""
    pack_into, offset, end = layout.pack_into, field.offset, field.offset + field.size

    def set_elements(self: Any, value: Collection[Any]) -> None:
        buffer = self._buf
        previous_bytes = buffer[offset:end]
        try:
            pack_into(buffer, offset, *value)
        except (StructError, OverflowError, TypeError):
            # struct clears the bytes before it raises
            buffer[offset:end] = previous_bytes
            # names of enum items and missing elements are rare, so only a failure leads to a second attempt
            try:
                pack_into(buffer, offset, *_pad_elements(field, value, enum))
            except (StructError, OverflowError, TypeError):
                buffer[offset:end] = previous_bytes
                raise misfit_error(owner, field, value) from None
        if not self._changed and not buffer.startswith(previous_bytes, offset):
            self._changed = True
        self._refreshed = True

    def set_bools(self: Any, value: Iterable[Any]) -> None:
        # struct packs any object as a bool
        value = tuple(value) if isinstance(value, Iterable) else (value,)
        if not {bool}.issuperset(map(type, value)):
            raise misfit_error(owner, field, value)
        set_elements(self, value)

    return set_bools if field.storage.python_type is bool else set_elements


def _pad_elements(field: FieldSchema, value: Collection[Any], enum: type[IntEnum] | None) -> list[Any]:
    """Return all elements of an array, with enum names as numbers and zeros at the end.

    :raises TypeError: if the value is not iterable or has no length.
    """
    elements = list(value)
    if enum is not None:
        elements = [
            getattr(enum, element, element) if isinstance(element, str) else element for element in elements
        ]
    # of the value, because len() refuses an iterator, whose elements the first attempt has consumed
    return elements + [0] * (field.runtime_length - len(value))


def fit_text(text: str, room: int) -> bytes:
    """Encode a text in at most ``room`` bytes, cut at a NUL or between characters.

    Surrogates of Python's ``surrogateescape`` become the bytes for which they stand, which are not UTF-8.

    :raises UnicodeEncodeError: if the text has other surrogates.
    """
    text = text.partition("\0")[0]
    encoded = text.encode("utf-8", "surrogateescape")
    cut = min(room, len(encoded))
    # 0x80 to 0xBF are the further bytes of a character in UTF-8
    while 0 < cut < len(encoded) and 0x80 <= encoded[cut] < 0xC0:  # noqa: PLR2004 - bytes of UTF-8
        cut -= 1
    return encoded[:cut]


_MAX_QUOTED_CHARACTERS = 60  # of a refused value in an error, so that the error stays readable
# One entry for each template and number of a field: enough for the five templates and 200 fields.
_MAX_CACHED_TEMPLATES = 1024

# The setters of numbers and strings compare values only while the block is not marked as changed; the setter
# of truth values always compares, which is as fast as writing. `adapt` converts a value, or raises an error.

_ENUM_GETTER_TEMPLATE = """
def make(item_of):
    def get(self):
        number = self._view.SLOT
        return item_of(number, number)
    return get
"""

_STRING_GETTER_TEMPLATE = """
def make():
    def get(self):
        return self._view.SLOT.decode("utf-8", "surrogateescape")
    return get
"""

_NUMBER_SETTER_TEMPLATE = """
def make(pack_into, offset, adapt):
    def set(self, value):
        view = self._view
        previous = view.SLOT
        try:
            pack_into(self._buf, offset, value)
        except (StructError, OverflowError):
            pack_into(self._buf, offset, previous)  # struct clears the bytes before it raises
            pack_into(self._buf, offset, adapt(value))
        if not self._changed and view.SLOT != previous:
            self._changed = True
        self._refreshed = True
    return set
"""

_BOOL_SETTER_TEMPLATE = """
def make(pack_into, offset, adapt):
    def set(self, value):
        if value is not True and value is not False:
            adapt(value)
        if self._view.SLOT is not value:
            pack_into(self._buf, offset, value)
            self._changed = True
        self._refreshed = True
    return set
"""

_STRING_SETTER_TEMPLATE = """
def make(pack_into, offset, room, adapt):
    def set(self, value):
        try:
            encoded = value.encode()
        except (AttributeError, UnicodeEncodeError):
            encoded = adapt(value)
        if len(encoded) > room or 0 in encoded:
            encoded = adapt(value)
        if self._changed or self._view.SLOT != encoded:
            pack_into(self._buf, offset, encoded)
            self._changed = True
        self._refreshed = True
    return set
"""


@lru_cache(_MAX_CACHED_TEMPLATES)
def _compile_template(source: str, slot: int) -> Callable[..., Any]:
    """Compile a template for the field with this number."""
    namespace: dict[str, Any] = {"StructError": StructError}
    exec(source.replace("SLOT", f"f{slot}"), namespace)  # noqa: S102 - the source is a template and a number
    factory: Callable[..., Any] = namespace["make"]
    return factory
