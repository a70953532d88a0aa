"""Reads the names in interface definitions in XML: the interface, its fields and its messages."""

from __future__ import annotations

import re

from cxbridge.clipstext.syntax import Lines
from cxbridge.errors import InterfaceDefinitionError
from cxbridge.interfaces.xml.tree import Element, read_tree
from cxbridge_studio.agent.names import (
    Mention,
    Name,
    NameKind,
    SourceFile,
    Use,
    make_parse_problem,
    make_single_piece_file,
)

_NAME_ATTRIBUTE = re.compile(r"""\sname\s*=\s*["']""")


def read_interface(path: str, text: str) -> SourceFile:
    """Read an interface definition. Broken files, and XML files that define no interface, have no names."""
    # Parsing is slow, and most XML files of a checkout define no interface.
    if "<interface" not in text:
        return SourceFile(path, text, ())
    try:
        # files that are not UTF-8 were decoded with surrogates: this restores their bytes for the parser
        root = read_tree(text.encode("utf-8", "surrogateescape"), path)
    except InterfaceDefinitionError as error:
        return SourceFile(path, text, (), make_parse_problem(error))
    if root.name != "interface":
        return SourceFile(path, text, ())
    lines = Lines(text)
    interface = root.attributes.get("name", "")
    mentions: list[Mention] = []

    def add_definition(element: Element, kind: NameKind, owner_name: str) -> None:
        name = element.attributes.get("name", "")
        # The tree only has the position of the start tag.
        attribute = _NAME_ATTRIBUTE.search(text, lines.position(element.line, element.column))
        if name and attribute is not None:
            start = attribute.end()
            mentions.append(Mention(Name(kind, name, owner_name), Use.DEFINED, start, start + len(name)))

    add_definition(root, NameKind.INTERFACE, "")
    for data_element in root.find_all("data"):
        for field in data_element.find_all("field"):
            add_definition(field, NameKind.FIELD, interface)
    for message in root.find_all("message"):
        add_definition(message, NameKind.MESSAGE, interface)
    interface_name = Name(NameKind.INTERFACE, interface) if interface else None
    return make_single_piece_file(path, text, "interface", interface_name, mentions)
