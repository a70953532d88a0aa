"""Reading of the constants and enums of an interface definition."""

from __future__ import annotations

from cxbridge.interfaces.fieldtypes import TYPES, parse_literal
from cxbridge.interfaces.names import RESERVED_IN_INTERFACES
from cxbridge.interfaces.schema import ConstantSchema, EnumItem, EnumSchema
from cxbridge.interfaces.xml.findings import Findings, NameScope
from cxbridge.interfaces.xml.tree import Element

# in Fawkes' C++ code a byte is an unsigned char, of which the generator writes no literals
_CONSTANT_TYPES = tuple(name for name in TYPES if name != "byte")


def read_constant(element: Element, scope: NameScope, findings: Findings) -> ConstantSchema:
    """Read a ``constant``.

    :raises InterfaceDefinitionError: if the constant is invalid.
    """
    findings.check_form(element, ("type", "name", "value"))
    name = findings.read_name(element, RESERVED_IN_INTERFACES)
    scope.add(element, name)
    comment = findings.read_comment(element)
    type_name = findings.read_attribute(element, "type")
    if type_name not in _CONSTANT_TYPES:
        hint = f"use one of {', '.join(_CONSTANT_TYPES)}"
        raise findings.make_error(element, f"a constant cannot be of type '{type_name}'", hint)
    text = element.attributes.get("value")
    value = None if text is None else parse_literal(type_name, text)
    if value is None:
        hint = f"write {TYPES[type_name].allowed_values}"
        raise findings.make_error(
            element,
            "<constant> has no attribute 'value'"
            if text is None
            else f"'{text}' is not a value of type {type_name}",
            hint,
        )
    return ConstantSchema(name, type_name, value, comment)


def read_enum(element: Element, scope: NameScope, findings: Findings) -> EnumSchema:
    """Read an ``enum``; invalid items are left out, and their errors collected.

    :raises InterfaceDefinitionError: if its name is invalid or in use, or the enum has no items.
    """
    findings.check_form(element, ("name",), ("comment", "item"))
    name = findings.read_name(element, RESERVED_IN_INTERFACES | TYPES.keys())
    scope.add(element, name)
    comment = findings.read_comment_child(element)
    item_elements = element.find_all("item")
    if not item_elements:
        raise findings.make_error(element, f"enum '{name}' has no <item>")
    items: list[EnumItem] = []
    for item_element in item_elements:
        # an invalid item does not hide the mistakes of the other items
        with findings.collecting_error():
            # as in C, an item without a value continues from the previous item
            items.append(_read_item(item_element, items[-1].value + 1 if items else 0, scope, findings))
    return EnumSchema(name, tuple(items), comment)


def _read_item(element: Element, default_value: int, scope: NameScope, findings: Findings) -> EnumItem:
    """Read an ``item``.

    :param default_value: the value of the item unless the element has a value.
    :raises InterfaceDefinitionError: if the name or the value is invalid, or the name is in use.
    """
    findings.check_form(element, ("name", "value"))
    name = findings.read_name(element, RESERVED_IN_INTERFACES)
    scope.add(element, name)
    comment = findings.read_comment(element)
    text = element.attributes.get("value") or str(default_value)
    value = parse_literal("int32", text)
    if not isinstance(value, int):
        raise findings.make_error(
            element, f"'{text}' is not a value of an enum", "values are 32-bit signed integers"
        )
    return EnumItem(name, value, comment)
