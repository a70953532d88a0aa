"""Reading of constants and enums."""

from __future__ import annotations

from cxbridge.interfaces.fieldtypes import TYPES, parse_literal
from cxbridge.interfaces.names import RESERVED_IN_INTERFACES, is_reserved
from cxbridge.interfaces.schema import ConstantSchema, EnumItem, EnumSchema
from cxbridge.interfaces.xml.findings import Findings, NameScope
from cxbridge.interfaces.xml.tree import Element
from cxbridge.suggestions import did_you_mean

_CONSTANT_TYPES = tuple(name for name in TYPES if name != "byte")
_INT32_LIMIT = 1 << 31  # C++ enums are 32 bit signed integers


def read_constant(element: Element, scope: NameScope, findings: Findings) -> ConstantSchema | None:
    """Read a ``constant``, or return None after an error."""
    findings.only(element, ())
    findings.known_attributes(element, ("type", "name", "value"))
    name = findings.name(element, "a constant", RESERVED_IN_INTERFACES, "MAX_SPEED")
    type_name = findings.attribute(element, "type", "uint32")
    text = element.attributes.get("value")
    if text is None:
        findings.error(element, "<constant> has no attribute 'value'", 'write value="1"')
    comment = findings.comment(element, f"constant '{name}'" if name else "a constant")
    if type_name is not None and type_name not in _CONSTANT_TYPES:
        otherwise = f"a constant may be {', '.join(_CONSTANT_TYPES)}"
        hint = (
            "use uint8"
            if type_name in ("byte", "char")
            else did_you_mean(type_name, _CONSTANT_TYPES, otherwise)
        )
        findings.error(element, f"a constant cannot be of type '{type_name}'", hint, "type")
        type_name = None
    if name is None or not scope.add(element, "constant", name) or type_name is None or text is None:
        return None
    value = parse_literal(type_name, text)
    if value is None:
        findings.error(
            element, f"'{text}' is not a value of type {type_name}", f"write {TYPES[type_name].fits}", "value"
        )
        return None
    return ConstantSchema(name, type_name, value, comment)


def read_enum(element: Element, scope: NameScope, findings: Findings) -> EnumSchema | None:
    """Read an ``enum``, or return None if its name is invalid; invalid items are left out."""
    findings.only(element, ("comment", "item"))
    findings.known_attributes(element, ("name",))
    name = findings.name(element, "an enum", RESERVED_IN_INTERFACES, "StatusEnum")
    subject = f"enum '{name}'" if name else "an enum"
    comment = findings.comment_child(element, subject)
    if name in TYPES or name == "char":
        findings.error(element, f"{subject} has the name of a type", f"call it e.g. {name}_enum", "name")
        name = None
    if name is not None and not scope.add(element, "enum", name):
        name = None
    item_elements = element.find_all("item")
    if not item_elements:
        findings.error(
            element, f"{subject} has no items", 'give it at least one <item name="...">comment</item>'
        )
    items: list[EnumItem] = []
    names: dict[int, str] = {}
    for item_element in item_elements:
        item = _read_item(item_element, items[-1].value + 1 if items else 0, scope, findings)
        if item is not None:
            _check_number(item_element, item, names, findings)
            items.append(item)
    return None if name is None else EnumSchema(name, tuple(items), comment)


def _read_item(element: Element, number: int, scope: NameScope, findings: Findings) -> EnumItem | None:
    """Read an ``item``.

    :param number: its value unless the element has one.
    """
    findings.only(element, ())
    findings.known_attributes(element, ("name", "value"))
    name = findings.name(element, "an enum item", RESERVED_IN_INTERFACES, "S_RUNNING")
    comment = findings.comment(element, f"enum item '{name}'" if name else "an enum item")
    text = element.attributes.get("value")
    if text:
        value = parse_literal("int64", text)
        if not isinstance(value, int):
            findings.error(
                element, f"'{text}' is not a number", 'write e.g. value="3", or leave it out', "value"
            )
            value = number
        number = value
    if name is None or not scope.add(element, "enum item", name):
        return None
    return EnumItem(name, number, comment)


def _check_number(element: Element, item: EnumItem, names: dict[int, str], findings: Findings) -> None:
    """Report a number that is out of range or used by an earlier item of the enum."""
    if not -_INT32_LIMIT <= item.value < _INT32_LIMIT:
        findings.error(
            element,
            f"enum item '{item.name}' would be {item.value}",
            "enum values are 32 bit signed integers",
            "value",
        )
    other = names.setdefault(item.value, item.name)
    if other != item.name:
        findings.error(
            element,
            f"enum items '{other}' and '{item.name}' are both {item.value}",
            "give every item a different number",
            "value",
        )


def check_type(
    element: Element, enums: dict[str, EnumSchema], reserved: frozenset[str], findings: Findings
) -> str | None:
    """Return the type of a field, or None after an error."""
    type_name = findings.attribute(element, "type", "uint32")
    if type_name is None or type_name in TYPES:
        return type_name
    if type_name in enums:
        if is_reserved(type_name, reserved):
            findings.error(
                element, f"'{type_name}' cannot be used here: the name is reserved", "rename the enum", "type"
            )
            return None
        return type_name
    if type_name == "char":
        findings.error(
            element,
            "type 'char' is not usable: Fawkes maps it to no C type",
            "use string, byte or int8",
            "type",
        )
        return None
    otherwise = (
        f"use one of {', '.join(TYPES)}, or an <enum> that is declared in the <constants> of this file"
    )
    findings.error(
        element,
        f"unknown type '{type_name}': neither a built-in type nor an enum of this file",
        did_you_mean(type_name, [*TYPES, *enums], otherwise),
        "type",
    )
    return None
