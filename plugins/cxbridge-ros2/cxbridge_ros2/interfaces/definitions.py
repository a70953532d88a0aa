"""ROS 2 definitions for interfaces and their messages, generated from the interface's schema.

``Position3DInterface`` becomes ``cxbridge_msgs/msg/Position3DInterface``; its messages become types such as
``cxbridge_msgs/msg/SkillerInterfaceExecSkillMessage``. Names are converted to ROS conventions: lower case for
fields, upper case for constants.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

from cxbridge.interfaces.schema import ConstantSchema, EnumSchema, FieldSchema, InterfaceSchema

PACKAGE: Final = "cxbridge_msgs"  # ROS package of the generated definitions

# Field with the interface's time stamp; interface fields with this name are renamed.
TIME: Final = "timestamp"

EXEC_SKILL: Final = f"{PACKAGE}/action/ExecSkill"  # action of a Skiller: executes a skill string

# Text of each action by type.
ACTIONS: Final = {
    EXEC_SKILL: """string skill_string  # e.g. goto{place="C-CS1"}
bool steal           # take control of the Skiller even if another client has it
---
bool success
string error         # the reason of a failure
---
string status        # as in SkillerInterface: S_RUNNING and the like
""",
}

_TYPES: Final = {
    **{name: name for name in ("bool", "string")},
    **{name: name for bits in (8, 16, 32, 64) for name in (f"int{bits}", f"uint{bits}")},
    "byte": "uint8",
    "float": "float32",
    "double": "float64",
}
_ENUM: Final = "int32"  # ROS has no enums; the items are constants


def type_of(interface: str, message: str = "") -> str:
    return f"{PACKAGE}/msg/{_camel(interface)}{_camel(message)}"


def definitions_of(schema: InterfaceSchema) -> dict[str, str]:
    """Return the definitions of an interface and its messages by type."""
    definitions = {type_of(schema.name): _definition(schema.fields, schema, has_time=True)}
    for message in schema.messages:
        definitions[type_of(schema.name, message.name)] = _definition(message.fields, schema, has_time=False)
    return definitions


def field_names(fields: Sequence[FieldSchema]) -> dict[str, str]:
    """Return the ROS names of fields, by their names in the interface."""
    used = {TIME}
    names = {}
    for field in fields:
        name = _unique(re.sub(r"[^a-z0-9]+", "_", field.name.lower()).strip("_"), "f_", used)
        names[field.name] = name
    return names


def _definition(fields: Sequence[FieldSchema], schema: InterfaceSchema, *, has_time: bool) -> str:
    lines = [f"builtin_interfaces/Time {TIME}"] if has_time else []
    names = field_names(fields)
    enum_names = {field.enum.name for field in fields if field.enum is not None}
    enums = [enum for enum in schema.enums if enum.name in enum_names]
    lines += _constants(enums, schema.constants if has_time else ())
    for field in fields:
        kind = _TYPES.get(field.type, _ENUM)
        length = f"[{field.length}]" if field.is_array else ""
        comment = " ".join(field.comment.split())
        lines.append(f"{kind}{length} {names[field.name]}{f'  # {comment}' if comment else ''}")
    return "\n".join((*lines, ""))


def _constants(enums: Sequence[EnumSchema], constants: Sequence[ConstantSchema]) -> Iterator[str]:
    used: set[str] = set()
    for enum in enums:
        for item in enum.items:
            yield f"{_ENUM} {_constant_name(item.name, used)}={item.value}"
    for constant in constants:
        value = repr(constant.value) if isinstance(constant.value, str) else str(constant.value)
        yield f"{_TYPES.get(constant.type, _ENUM)} {_constant_name(constant.name, used)}={value}"


def _constant_name(name: str, used: set[str]) -> str:
    return _unique(re.sub(r"[^A-Z0-9]+", "_", name.upper()).strip("_"), "C_", used)


def _unique(name: str, prefix: str, used: set[str]) -> str:
    """Return an unused name that begins with a letter, and mark it as used."""
    unique = plain = name if name[:1].isalpha() else f"{prefix}{name}"
    number = 2
    while unique in used:
        # _ after a digit: a1 and a second a must not both become a12
        unique = f"{plain}{'_' if plain[-1].isdigit() else ''}{number}"
        number += 1
    used.add(unique)
    return unique


def _camel(name: str) -> str:
    return "".join(word[:1].upper() + word[1:] for word in re.split(r"[^A-Za-z0-9]+", name))
