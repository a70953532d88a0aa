"""Copies of facts, and conversion of their slot values to members of the API's models."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias, TypeVar, get_args, get_origin

from msgspec import UNSET
from msgspec.structs import fields

from cxbridge.executive.host.facts.copying import FactCopier, FactCopy
from cxbridge.executive.host.values import Symbol, Value
from cxbridge_web.endpoint import ApiCall, ApiError
from cxbridge_web.models import Model

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

Slots: TypeAlias = Mapping[str, Value]  # the values of a fact by slot

COPY_TIMEOUT_S: Final = 60.0  # the time limit for copying facts: long, because the copy is made in pieces

DEFAULT_ENVIRONMENT: Final = "executive"
"""The name of the default CLIPS environment."""


class SlotError(Exception):
    """A slot has no value or a value that does not fit its member, or a formula contains itself."""


def find_environment(call: ApiCall, name: str = DEFAULT_ENVIRONMENT, status: int = 503) -> ClipsEnvironment:
    """Return a CLIPS environment.

    :param status: the HTTP status of the error.
    :raises ApiError: if the environment does not exist.
    """
    env = call.host.environments().get(name)
    if env is None:
        if status == 404:  # noqa: PLR2004 - the HTTP status; Fawkes' components have different texts
            raise ApiError(404, f"Environment '{name}' is unknown")
        raise ApiError(status, f"No CLIPS environment named '{name}' found")
    return env


def copy_facts(
    call: ApiCall,
    name: str,
    is_selected: Callable[[str], bool],
    status: int = 503,
) -> Generator[None, None, FactCopy]:
    """Copy facts of an environment in pieces.

    :param is_selected: returns whether to copy the facts of a deftemplate, by its name.
    :param status: the HTTP status if the environment is missing or ends during the request.
    :raises ApiError: if the environment does not exist, or is replaced during the request.
    """
    env = find_environment(call, name, status)
    copier = FactCopier(env.c_env, is_selected)
    pieces, end_marker = copier.pieces(), object()
    while True:
        with env.lock:
            if next(pieces, end_marker) is end_marker:
                return copier.copy
        yield  # without the lock: the rules may run before the next piece
        if find_environment(call, name, status) is not env:
            raise ApiError(503, f"The CLIPS environment '{name}' was replaced during the request")


def _read_first_value(slots: Slots, name: str) -> Value:
    """Return the value of a slot, or the first value of a multislot.

    :raises SlotError: if the slot has no value.
    """
    value = slots.get(name, ())
    if isinstance(value, tuple):
        if not value:
            raise SlotError(f"No value for slot '{name}'")
        value = value[0]
    return value


def read_text(slots: Slots, name: str) -> str:
    """Return the value of a slot as a text; empty for nil.

    :raises SlotError: if the slot has no value, or the value is not a text.
    """
    value = _read_first_value(slots, name)
    if not isinstance(value, str):
        raise SlotError(f"Value for slot '{name}' is not a text")
    return "" if isinstance(value, Symbol) and value == "nil" else str(value)


def read_number(slots: Slots, name: str) -> float:
    """Return the value of a slot as a number; 0 for nil.

    :raises SlotError: if the slot has no value, or the value is not a number.
    """
    value = _read_first_value(slots, name)
    if isinstance(value, Symbol) and value == "nil":  # an unset slot
        return 0
    if not isinstance(value, int | float):
        raise SlotError(f"Value for slot '{name}' is not a number")
    return value


def read_integer(slots: Slots, name: str) -> int:
    """Return the value of a slot, truncated to an integer; 0 for nil.

    :raises SlotError: if the slot has no value, or the value is not a finite number.
    """
    try:
        return int(read_number(slots, name))
    except (OverflowError, ValueError) as error:
        raise SlotError(f"Value for slot '{name}' is not an integer") from error


def read_flag(slots: Slots, name: str) -> bool:
    """Return whether the value of a slot is TRUE.

    :raises SlotError: if the slot has no value, or the value is not a symbol.
    """
    value = _read_first_value(slots, name)
    if not isinstance(value, Symbol):
        raise SlotError(f"Value for slot '{name}' is not a boolean")
    return value == "TRUE"


def read_texts(slots: Slots, name: str, placeholder: str = "CANNOT-REPRESENT") -> list[str]:
    """Return all values of a slot as texts; empty if the fact lacks the slot.

    :param placeholder: replaces values without a text form, such as addresses.
    """
    value = slots.get(name, ())
    return [_format_value(item, placeholder) for item in (value if isinstance(value, tuple) else (value,))]


Reader: TypeAlias = Callable[[Slots, str], Any]

# Readers of slots by the type of the model's member.
_SLOT_READERS: Final[Mapping[Any, Reader]] = {
    str: read_text,
    list[str]: read_texts,
    int: read_integer,
    float: lambda slots, name: float(read_number(slots, name)),
    bool: read_flag,
}

_ModelT = TypeVar("_ModelT", bound=Model)


@cache
def _find_member_slots(model: type[Model]) -> tuple[tuple[str, str, Reader, bool], ...]:
    """Return the members that slots provide: member, slot, reader, whether the member is required.

    The slot has the member's name in JSON, or the name in ``Meta(extra={"slot": NAME})``.
    """
    members = []
    for member in fields(model):
        member_type, name = member.type, member.encode_name
        if get_origin(member_type) is Annotated:
            member_type, meta = get_args(member_type)
            name = (meta.extra or {}).get("slot", name)
        if member.default is UNSET:
            member_type = get_args(member_type)[0]  # an optional member: TYPE | UnsetType
        if member_type in _SLOT_READERS:
            members.append((member.name, name, _SLOT_READERS[member_type], member.required))
    return tuple(members)


def read_model(model: type[_ModelT], slots: Slots, **members: Any) -> _ModelT:
    """Return the model of a fact, with each member from its slot.

    :param members: the members that are not in the fact.
    :raises SlotError: if a slot has no value or a wrong type.
    """
    for member, name, reader, is_required in _find_member_slots(model):
        if member not in members and (is_required or name in slots):
            members[member] = reader(slots, name)
    return model(**members)


def _format_value(value: Value, placeholder: str) -> str:
    if isinstance(value, float):
        return f"{value:f}"  # as std::to_string in Fawkes
    if isinstance(value, str | int):
        return str(value)
    return placeholder
