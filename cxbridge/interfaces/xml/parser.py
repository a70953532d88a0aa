"""Parser of interface definitions, from XML to a schema.

The rules are those of Fawkes' interface generator (its parser, not its DTD). This parser also refuses
definitions of which no working C++ interface could result (invalid identifiers, names that clash within the
class, the type ``char``), and constants that do not parse, which the generator silently drops.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

from msgspec import Struct

from cxbridge.errors import InterfaceDefinitionError
from cxbridge.interfaces.layout import place_fields
from cxbridge.interfaces.names import (
    MAX_MESSAGE_LENGTH,
    MAX_TYPE_LENGTH,
    RESERVED_IN_INTERFACES,
    RESERVED_IN_MESSAGES,
    interface_type_name,
    message_type_name,
)
from cxbridge.interfaces.schema import (
    ConstantSchema,
    EnumSchema,
    FieldSchema,
    InterfaceSchema,
    MessageSchema,
)
from cxbridge.interfaces.xml.constants import read_constant, read_enum
from cxbridge.interfaces.xml.fields import MAX_DATASIZE, DataFields, find_field, read_field
from cxbridge.interfaces.xml.findings import Findings, NameScope
from cxbridge.interfaces.xml.tree import MAX_FILE_SIZE, Element, read_tree


class CheckResult(Struct, frozen=True):
    """The result of checking a definition.

    :param schema: the schema; None if there are errors.
    :param errors: the errors in the order of the file.
    :param warnings: constructs that Fawkes accepts but that are probably mistakes.
    """

    schema: InterfaceSchema | None
    errors: tuple[InterfaceDefinitionError, ...]
    warnings: tuple[InterfaceDefinitionError, ...] = ()


def parse_file(path: str | Path) -> InterfaceSchema:
    """Read a definition file.

    :raises InterfaceDefinitionError: the first error of the file, or the reason why it cannot be read.
    """
    return _parse(_read_bytes(path), str(path))


def parse_bytes(xml: bytes, file: str | Path | None = None) -> InterfaceSchema:
    """Read a definition; its hash is the MD5 of the bytes.

    :raises InterfaceDefinitionError: the first error.
    """
    result = check_bytes(xml, file)
    if result.schema is None:
        raise result.errors[0]
    return result.schema


@lru_cache(maxsize=128)  # enough for the definitions of cxbridge and of a Fawkes checkout
def _parse(xml: bytes, file: str) -> InterfaceSchema:
    """Parse each content of a file only once.

    Errors are not cached. Definitions of recordings are not cached either: they are freed with the recording.
    """
    return parse_bytes(xml, file)


def _read_bytes(path: str | Path) -> bytes:
    """Return at most `MAX_FILE_SIZE` + 1 bytes of a file."""
    # the extra byte shows that a file is too large
    try:
        with Path(path).open("rb") as stream:
            return stream.read(MAX_FILE_SIZE + 1)
    except OSError as error:
        raise InterfaceDefinitionError(
            f"cannot read the interface definition: {error.strerror}", file=path, hint="check the path"
        ) from error


def check_file(path: str | Path) -> CheckResult:
    """Return the schema of a definition file, or all its errors.

    An unreadable file or a wrong file name is an error, too.
    """
    try:
        result = check_bytes(_read_bytes(path), path)
    except InterfaceDefinitionError as error:
        return CheckResult(None, (error,))
    if result.schema is not None and Path(path).name != f"{result.schema.name}.xml":
        return CheckResult(None, (make_name_error(result.schema, path),), result.warnings)
    return result


def make_name_error(schema: InterfaceSchema, path: str | Path) -> InterfaceDefinitionError:
    """Return the error of a definition in a file of another name: no registry would find the type."""
    return InterfaceDefinitionError(
        f"the file defines {schema.name}, not {Path(path).name.removesuffix('.xml')}",
        file=path,
        line=1,
        hint=f"rename the file to {schema.name}.xml, or the interface to the name of the file",
    )


def check_bytes(xml: bytes, file: str | Path | None = None) -> CheckResult:
    """Return the schema of a definition, or all its errors; never raises."""
    file_name = None if file is None else str(file)
    try:
        root = read_tree(xml, file_name)
    except InterfaceDefinitionError as error:
        return CheckResult(None, (error,))
    findings = Findings(file_name)
    digest = hashlib.md5(xml, usedforsecurity=False).digest()  # Fawkes' version of an interface
    schema = _DefinitionReader(root, findings).read(digest, file_name or "")
    errors = tuple(sorted(findings.errors, key=lambda error: (error.line or 0, error.column or 0)))
    return CheckResult(None if errors else schema, errors, tuple(findings.warnings))


class _DefinitionReader:
    """Reads the tree of one definition."""

    def __init__(self, root: Element, findings: Findings) -> None:
        self._root = root
        self._findings = findings
        self._scope = NameScope(findings)  # all names that become members of the C++ class
        self._constants: list[ConstantSchema] = []
        self._enums: dict[str, EnumSchema] = {}
        self._fields: DataFields = {}
        self._data_comment = ""

    def read(self, digest: bytes, source: str) -> InterfaceSchema | None:
        """Read the whole definition; None if the document is not an interface.

        The schema is only valid if the findings have no errors.
        """
        root, findings = self._root, self._findings
        if root.name != "interface":
            findings.report_error(root, f"the document is a <{root.name}>, not an interface")
            return None
        findings.check_form(root, ("name", "author", "year", "created"), ("constants", "data", "message"))
        name = ""
        with findings.collecting_error():
            name = self._read_name()
        self._read_constants()
        self._read_data()
        messages: list[MessageSchema] = []
        for element in root.find_all("message"):
            with findings.collecting_error():
                messages.append(self._read_message(element))
        fields, datasize = place_fields(field for field in self._fields.values() if field is not None)
        if datasize > MAX_DATASIZE:
            findings.report_error(root, f"the block would have {datasize} bytes, the limit is {MAX_DATASIZE}")
        return InterfaceSchema(
            name=name,
            hash=digest,
            datasize=datasize,
            fields=fields,
            messages=tuple(messages),
            enums=tuple(self._enums.values()),
            constants=tuple(self._constants),
            comment=self._data_comment,
            source=source,
        )

    def _read_name(self) -> str:
        """Return the name of the type with suffix."""
        type_name = interface_type_name(self._findings.read_name(self._root))
        if len(type_name) > MAX_TYPE_LENGTH:
            raise self._findings.make_error(
                self._root,
                f"the type '{type_name}' has {len(type_name)} characters, the limit is {MAX_TYPE_LENGTH}",
            )
        return type_name

    def _find_only_child(self, name: str) -> Element | None:
        """Return the first child of the root with a name, or None; report an error for each further child."""
        children = self._root.find_all(name)
        for surplus_child in children[1:]:
            self._findings.report_error(surplus_child, f"a second <{name}>: an interface has at most one")
        return children[0] if children else None

    def _read_constants(self) -> None:
        """Read the optional block of constants and enums."""
        block = self._find_only_child("constants")
        if block is None:
            return
        findings = self._findings
        findings.check_form(block, (), ("constant", "enum"))
        for element in block.children:
            with findings.collecting_error():
                if element.name == "constant":
                    self._constants.append(read_constant(element, self._scope, findings))
                elif element.name == "enum":
                    enum = read_enum(element, self._scope, findings)
                    self._enums[enum.name] = enum

    def _read_data(self) -> None:
        """Read the required block of data fields."""
        findings = self._findings
        block = self._find_only_child("data")
        if block is None:
            findings.report_error(self._root, "the interface has no <data>")
            return
        findings.check_form(block, (), ("comment", "field"))
        self._data_comment = findings.read_comment_child(block)
        elements = block.find_all("field")
        if not elements:
            findings.report_error(block, "the data block has no <field>")
        for element in elements:
            # a wrong field is known by its name: references to the field cause no further errors
            self._fields.setdefault(element.attributes.get("name", ""), None)
            with findings.collecting_error():
                field = read_field(element, self._enums, RESERVED_IN_INTERFACES, self._scope, findings)
                self._fields[field.name] = field

    def _read_message(self, element: Element) -> MessageSchema:
        findings = self._findings
        findings.check_form(element, ("name",), ("comment", "field", "ref"))
        name = message_type_name(findings.read_name(element))
        if len(name) > MAX_MESSAGE_LENGTH:
            raise findings.make_error(
                element, f"the message '{name}' has {len(name)} characters, the limit is {MAX_MESSAGE_LENGTH}"
            )
        self._scope.add(element, name)
        comment = findings.read_comment_child(element)
        scope = NameScope(findings)
        fields: list[FieldSchema] = []
        # fields first, then references: Fawkes' order of the fields in the struct
        for child in element.find_all("field"):
            with findings.collecting_error():
                fields.append(read_field(child, self._enums, RESERVED_IN_MESSAGES, scope, findings))
        for child in element.find_all("ref"):
            with findings.collecting_error():
                findings.check_form(child, ())
                field = find_field(child, self._fields, findings)
                if field is not None:
                    scope.add(child, field.name)
                    fields.append(field)
        placed_fields, datasize = place_fields(fields)
        return MessageSchema(name, datasize, placed_fields, comment)
