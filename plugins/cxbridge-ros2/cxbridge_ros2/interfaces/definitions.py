"""ROS 2 definitions of blackboard interfaces, generated from the interfaces' schemas.

``Position3DInterface`` becomes ``cxbridge_msgs/msg/Position3DInterface``. ROS requires lower case for
the names of fields, and upper case for constants.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from cxbridge.interfaces.fieldtypes import storage_type
from cxbridge.interfaces.schema import ConstantSchema, EnumSchema, FieldSchema, InterfaceSchema

PACKAGE: Final = "cxbridge_msgs"  # the ROS package of the generated definitions

# The field with the time stamp of an interface. A field of an interface with this name gets another name.
TIME_FIELD: Final = "timestamp"

# the action of a Skiller, which executes skill strings
EXEC_SKILL_TYPE: Final = f"{PACKAGE}/action/ExecSkill"

# The definition of each action, in the format of .action files.
ACTION_DEFINITIONS: Final = {
    EXEC_SKILL_TYPE: """string skill_string  # e.g. goto{place="C-CS1"}
bool steal           # take control of the Skiller even if another client has it
---
bool success
string error         # the reason for a failure
---
string status        # as in SkillerInterface: S_RUNNING and the like
""",
}


def make_ros_message_type(interface: str) -> str:
    return f"{PACKAGE}/msg/{_to_camel_case(interface)}"


def generate_definitions(schemas: Iterable[InterfaceSchema]) -> dict[str, str]:
    """Return the texts of the definitions of interfaces, by message type."""
    return {make_ros_message_type(schema.name): _format_definition(schema) for schema in schemas}


def make_ros_field_names(fields: Sequence[FieldSchema]) -> dict[str, str]:
    """Return the names of fields in ROS, by their names in the interface."""
    used_names = {TIME_FIELD}
    ros_names = {}
    for field in fields:
        ros_name = re.sub(r"[^a-z0-9]+", "_", field.name.lower()).strip("_")
        ros_names[field.name] = _make_unique_name(ros_name, "f_", used_names)
    return ros_names


def _format_definition(schema: InterfaceSchema) -> str:
    fields, ros_names = schema.fields, make_ros_field_names(schema.fields)
    # only the enums of fields: ROS does not get the values of the other enums, such as those of messages
    enum_names = {field.enum.name for field in fields if field.enum is not None}
    enums = [enum for enum in schema.enums if enum.name in enum_names]
    lines = [f"builtin_interfaces/Time {TIME_FIELD}", *_format_constants(enums, schema.constants)]
    for field in fields:
        ros_type = _find_ros_type(field.type)
        length = f"[{field.length}]" if field.is_array else ""
        comment = " ".join(field.comment.split())
        lines.append(f"{ros_type}{length} {ros_names[field.name]}{f'  # {comment}' if comment else ''}")
    return "\n".join((*lines, ""))


def _format_constants(enums: Sequence[EnumSchema], constants: Sequence[ConstantSchema]) -> Iterator[str]:
    used_names: set[str] = set()
    for enum in enums:
        for item in enum.items:
            yield f"{_find_ros_type(enum.name)} {_make_constant_name(item.name, used_names)}={item.value}"
    for constant in constants:
        value = repr(constant.value) if isinstance(constant.value, str) else str(constant.value)
        ros_type = _find_ros_type(constant.type)
        yield f"{ros_type} {_make_constant_name(constant.name, used_names)}={value}"


def _find_ros_type(type_name: str) -> str:
    """Return the ROS type for a field type.

    ROS has no enums: a field with an enum becomes a number, and the items of the enum become constants.
    """
    storage = storage_type(type_name)
    # as in the module struct, the codes of unsigned types are in upper case
    number = "float" if storage.python_type is float else "uint" if storage.code.isupper() else "int"
    return type_name if storage.python_type in (bool, str) else f"{number}{8 * storage.size}"


def _make_constant_name(name: str, used_names: set[str]) -> str:
    return _make_unique_name(re.sub(r"[^A-Z0-9]+", "_", name.upper()).strip("_"), "C_", used_names)


def _make_unique_name(name: str, prefix: str, used_names: set[str]) -> str:
    """Return an unused name that begins with a letter, and add the name to the used names.

    :param prefix: precedes a name that begins with another character.
    """
    unique_name = base_name = name if name[:1].isalpha() else f"{prefix}{name}"
    number = 2
    while unique_name in used_names:
        # _ after a digit: a second a1 becomes a1_2, since a12 looks like another name
        unique_name = f"{base_name}{'_' if base_name[-1].isdigit() else ''}{number}"
        number += 1
    used_names.add(unique_name)
    return unique_name


def _to_camel_case(name: str) -> str:
    return "".join(word[:1].upper() + word[1:] for word in re.split(r"[^A-Za-z0-9]+", name))
