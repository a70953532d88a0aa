"""Reading of constants and enums, and of the types that fields may have."""

from __future__ import annotations

from cxbridge.interfaces.fieldtypes import TYPES, parse_literal
from cxbridge.interfaces.names import RESERVED_IN_INTERFACES, is_reserved
from cxbridge.interfaces.schema import ConstantSchema, EnumItem, EnumSchema
from cxbridge.interfaces.xml.findings import Findings, NameScope
from cxbridge.interfaces.xml.tree import Element
from cxbridge.suggestions import did_you_mean

_CONSTANT_TYPES = tuple(name for name in TYPES if name != "byte")
_INT32_LIMIT = 1 << 31  # C++ enums are 32-bit signed integers


def read_constant(element: Element, scope: NameScope, findings: Findings) -> ConstantSchema:
    """Read a ``constant``.

    :raises InterfaceDefinitionError: if it is invalid.
    """
    findings.check_form(element, ("type", "name", "value"))
    name = findings.read_name(element, "a constant", RESERVED_IN_INTERFACES, "MAX_SPEED")
    scope.add(element, "constant", name)
    comment = findings.read_comment(element, f"constant '{name}'")
    type_name = findings.read_attribute(element, "type", "uint32")
    if type_name not in _CONSTANT_TYPES:
        fallback_hint = f"a constant must be {', '.join(_CONSTANT_TYPES)}"
        # in Fawkes' C++ code a byte is an unsigned char, of which the generator writes no literals
        hint = (
            "use uint8"
            if type_name in ("byte", "char")
            else did_you_mean(type_name, _CONSTANT_TYPES, fallback_hint)
        )
        raise findings.make_error(element, f"a constant cannot be of type '{type_name}'", hint, "type")
    text = element.attributes.get("value")
    if text is None:
        raise findings.make_error(element, "<constant> has no attribute 'value'", 'write value="1"')
    value = parse_literal(type_name, text)
    if value is None:
        hint = f"write {TYPES[type_name].allowed_values}"
        raise findings.make_error(element, f"'{text}' is not a value of type {type_name}", hint, "value")
    return ConstantSchema(name, type_name, value, comment)


def read_enum(element: Element, scope: NameScope, findings: Findings) -> EnumSchema:
    """Read an ``enum``; invalid items are left out.

    :raises InterfaceDefinitionError: if its name is invalid.
    """
    findings.check_form(element, ("name",), ("comment", "item"))
    name = findings.read_name(element, "an enum", RESERVED_IN_INTERFACES, "StatusEnum")
    subject = f"enum '{name}'"
    if name in TYPES or name == "char":
        raise findings.make_error(
            element, f"{subject} has the same name as a type", f"call it e.g. {name}_enum", "name"
        )
    scope.add(element, "enum", name)
    comment = findings.read_comment_child(element, subject)
    item_elements = element.find_all("item")
    if not item_elements:
        findings.report_error(
            element, f"{subject} has no items", 'give it at least one <item name="...">comment</item>'
        )
    items: list[EnumItem] = []
    names: dict[int, str] = {}
    for item_element in item_elements:
        # an invalid item does not hide the mistakes of the other items
        with findings.collecting_error():
            # as in C, an item without a value continues from the previous item
            item = _read_item(item_element, items[-1].value + 1 if items else 0, scope, findings)
            items.append(item)
            _check_item_value(item_element, item, names, findings)
    return EnumSchema(name, tuple(items), comment)


def _read_item(element: Element, number: int, scope: NameScope, findings: Findings) -> EnumItem:
    """Read an ``item``.

    :param number: the value of the item unless the element has a value.
    """
    findings.check_form(element, ("name", "value"))
    name = findings.read_name(element, "an enum item", RESERVED_IN_INTERFACES, "S_RUNNING")
    scope.add(element, "enum item", name)
    comment = findings.read_comment(element, f"enum item '{name}'")
    text = element.attributes.get("value")
    value = parse_literal("int64", text) if text else number
    if not isinstance(value, int):
        hint = 'write e.g. value="3", or omit it'
        raise findings.make_error(element, f"'{text}' is not a number", hint, "value")
    return EnumItem(name, value, comment)


def _check_item_value(element: Element, item: EnumItem, names: dict[int, str], findings: Findings) -> None:
    """Check that an item's number has 32 bits and is not used by an earlier item of the enum."""
    if not -_INT32_LIMIT <= item.value < _INT32_LIMIT:
        hint = "enum values are 32-bit signed integers"
        raise findings.make_error(element, f"enum item '{item.name}' would be {item.value}", hint, "value")
    first_name = names.setdefault(item.value, item.name)
    if first_name != item.name:
        raise findings.make_error(
            element,
            f"enum items '{first_name}' and '{item.name}' are both {item.value}",
            "give every item a different number",
            "value",
        )


def read_type(
    element: Element, enums: dict[str, EnumSchema], reserved: frozenset[str], findings: Findings
) -> str:
    """Return the type of a field.

    :raises InterfaceDefinitionError: if there is no such type, or its name cannot be used here.
    """
    type_name = findings.read_attribute(element, "type", "uint32")
    if type_name in TYPES or (type_name in enums and not is_reserved(type_name, reserved)):
        return type_name
    message = f"unknown type '{type_name}': neither a built-in type nor an enum of this file"
    fallback_hint = (
        f"use one of {', '.join(TYPES)}, or an <enum> that is declared in the <constants> of this file"
    )
    hint = did_you_mean(type_name, [*TYPES, *enums], fallback_hint)
    if type_name in enums:
        message, hint = f"'{type_name}' cannot be used here: the name is reserved", "rename the enum"
    elif type_name == "char":
        message, hint = "type 'char' cannot be used: Fawkes maps it to no C type", "use string, byte or int8"
    raise findings.make_error(element, message, hint, "type")
