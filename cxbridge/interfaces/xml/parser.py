"""Parser of interface definitions, from XML to a schema.

The rules are those of Fawkes' interface generator (its parser, not its DTD). It is stricter where no working
C++ interface could result: invalid identifiers, names that clash within the class, enum items with equal
numbers, the type ``char``, and constants that do not parse, which the generator silently drops.
"""

from __future__ import annotations

import contextlib
import hashlib
from functools import lru_cache
from pathlib import Path

from msgspec import Struct

from cxbridge.errors import InterfaceDefinitionError
from cxbridge.interfaces.layout import place_fields
from cxbridge.interfaces.names import (
    MAX_MESSAGE_LENGTH,
    MAX_TYPE_LENGTH,
    MESSAGE_SUFFIX,
    RESERVED_IN_INTERFACES,
    RESERVED_IN_MESSAGES,
    interface_type_name,
    is_identifier,
    message_type_name,
)
from cxbridge.interfaces.schema import (
    ConstantSchema,
    EnumSchema,
    InterfaceSchema,
    MessageSchema,
    PseudoMapSchema,
)
from cxbridge.interfaces.xml.constants import read_constant, read_enum
from cxbridge.interfaces.xml.fields import MAX_DATASIZE, DataFields, find_field, read_field, read_pseudomap
from cxbridge.interfaces.xml.findings import Findings, NameScope, TooManyFindings
from cxbridge.interfaces.xml.tree import MAX_FILE_SIZE, Element, read_tree


class CheckResult(Struct, frozen=True):
    """The result of checking a definition.

    :param schema: None if there are errors.
    :param errors: in the order of the file.
    :param warnings: constructs that Fawkes accepts but that are probably mistakes.
    """

    schema: InterfaceSchema | None
    errors: tuple[InterfaceDefinitionError, ...]
    warnings: tuple[InterfaceDefinitionError, ...] = ()


def parse_file(path: str | Path) -> InterfaceSchema:
    """Read a definition file.

    :raises InterfaceDefinitionError: the first error of the file, with the number of further ones.
    """
    return _parse(_read(path), str(path))


def parse_bytes(data: bytes, file: str | Path | None = None) -> InterfaceSchema:
    """Read a definition; its hash is the MD5 of the bytes.

    :raises InterfaceDefinitionError: the first error, with the number of further ones.
    """
    return _schema_of(check_bytes(data, file))


@lru_cache(maxsize=128)
def _parse(data: bytes, file: str) -> InterfaceSchema:
    """Read a file once per process.

    Errors are not cached; neither are definitions of recordings, which are freed with the recording.
    """
    return parse_bytes(data, file)


def _read(path: str | Path) -> bytes:
    """Return at most `MAX_FILE_SIZE` + 1 bytes of a file."""
    # the extra byte lets the parser detect files that are too large
    try:
        with Path(path).open("rb") as stream:
            return stream.read(MAX_FILE_SIZE + 1)
    except OSError as error:
        raise InterfaceDefinitionError(
            f"cannot read the interface definition: {error.strerror}", file=path, hint="check the path"
        ) from error


def check_file(path: str | Path) -> CheckResult:
    """Return all errors of a definition file, including that it cannot be read."""
    try:
        return check_bytes(_read(path), path)
    except InterfaceDefinitionError as error:
        return CheckResult(None, (error,))


def check_bytes(data: bytes, file: str | Path | None = None) -> CheckResult:
    """Return all errors of a definition; never raises."""
    name = None if file is None else str(file)
    try:
        root = read_tree(data, name)
    except InterfaceDefinitionError as error:
        return CheckResult(None, (error,))
    findings = Findings(name)
    digest = hashlib.md5(data, usedforsecurity=False).digest()
    schema = None
    with contextlib.suppress(TooManyFindings):  # reading ends early, but the errors so far are reported
        schema = _Definition(root, findings).read(digest, name or "")
    errors = tuple(sorted(findings.errors, key=lambda error: (error.line or 0, error.column or 0)))
    return CheckResult(None if errors else schema, errors, tuple(findings.warnings))


def _schema_of(result: CheckResult) -> InterfaceSchema:
    """Return the schema, or raise the first error."""
    if result.schema is not None:
        return result.schema
    first, more = result.errors[0], len(result.errors) - 1
    if more:
        first = InterfaceDefinitionError(
            f"{first.message} (and {more} more: see 'cxbridge interface check')",
            file=first.file,
            line=first.line,
            column=first.column,
            hint=first.hint,
        )
    raise first


class _Definition:
    """Reads the tree of one definition."""

    def __init__(self, root: Element, findings: Findings) -> None:
        self._root = root
        self._findings = findings
        self._scope = NameScope(findings)  # all names that become members of the C++ class
        self._constants: list[ConstantSchema] = []
        self._enums: dict[str, EnumSchema] = {}
        self._fields: DataFields = {}
        self._pseudomaps: list[PseudoMapSchema] = []
        self._data_comment = ""

    def read(self, digest: bytes, source: str) -> InterfaceSchema | None:
        """Read the whole definition; the result is only valid without errors."""
        root, findings = self._root, self._findings
        if root.name != "interface":
            findings.error(
                root,
                f"the document is a <{root.name}>, not an interface",
                'begin with <interface name="...">',
            )
            return None
        findings.only(root, ("constants", "data", "message"))
        findings.known_attributes(root, ("name", "author", "year", "created"))
        name = self._read_name()
        self._read_constants()
        self._read_data()
        messages = self._read_messages()
        fields, datasize = place_fields(field for field in self._fields.values() if field is not None)
        if datasize > MAX_DATASIZE:
            findings.error(
                root, f"the block would have {datasize} bytes, the limit is {MAX_DATASIZE}", "shorten it"
            )
        return InterfaceSchema(
            name=name,
            hash=digest,
            datasize=datasize,
            fields=fields,
            messages=messages,
            enums=tuple(self._enums.values()),
            constants=tuple(self._constants),
            pseudomaps=tuple(self._pseudomaps),
            comment=self._data_comment,
            author=root.attributes.get("author", ""),
            year=root.attributes.get("year", ""),
            created=root.attributes.get("created", ""),
            source=source,
        )

    def _read_name(self) -> str:
        """Return the name of the type with suffix."""
        name = self._findings.attribute(self._root, "name", "MyInterface") or ""
        type_name = interface_type_name(name)
        if name and not is_identifier(name):
            self._findings.error(
                self._root,
                f"'{name}' cannot be the name of an interface",
                "a name has letters and digits, and begins with a letter",
                "name",
            )
        elif len(type_name) > MAX_TYPE_LENGTH:
            self._findings.error(
                self._root,
                f"the type '{type_name}' has {len(type_name)} characters, the limit is {MAX_TYPE_LENGTH}",
                "shorten the name",
                "name",
            )
        return type_name

    def _single_child(self, name: str, *, required: bool) -> Element | None:
        """Return the single child of the root with a name."""
        found = self._root.find_all(name)
        for extra in found[1:]:
            self._findings.error(
                extra, f"a second <{name}>", f"put everything into the <{name}> of line {found[0].line}"
            )
        if not found and required:
            self._findings.error(
                self._root,
                f"the interface has no <{name}>",
                f"add <{name}> with a <comment> and at least one <field>",
            )
        return found[0] if found else None

    def _read_constants(self) -> None:
        """Read the optional block of constants and enums."""
        block = self._single_child("constants", required=False)
        if block is None:
            return
        self._findings.only(block, ("constant", "enum"))
        for element in block.children:
            if element.name == "constant":
                constant = read_constant(element, self._scope, self._findings)
                if constant is not None:
                    self._constants.append(constant)
            elif element.name == "enum":
                enum = read_enum(element, self._scope, self._findings)
                if enum is not None:
                    self._enums[enum.name] = enum

    def _read_data(self) -> None:
        # fields first, because pseudo maps may refer to any of them
        findings = self._findings
        block = self._single_child("data", required=True)
        if block is None:
            return
        findings.only(block, ("comment", "field", "pseudomap"))
        self._data_comment = findings.comment_child(block, "the data block")
        elements = block.find_all("field")
        if not elements:
            findings.error(
                block, "the data block has no field", 'add at least one <field type="..." name="...">'
            )
        for element in elements:
            field = read_field(element, self._enums, RESERVED_IN_INTERFACES, self._scope, findings)
            self._fields.setdefault(element.attributes.get("name", ""), field)
        for element in block.find_all("pseudomap"):
            pseudomap = read_pseudomap(element, self._fields, self._enums, self._scope, findings)
            if pseudomap is not None:
                self._pseudomaps.append(pseudomap)

    def _read_messages(self) -> tuple[MessageSchema, ...]:
        messages = []
        for element in self._root.find_all("message"):
            message = self._read_message(element)
            if message is not None:
                messages.append(message)
        return tuple(messages)

    def _read_message(self, element: Element) -> MessageSchema | None:
        # fields first, then references, in the order in which Fawkes lays them out
        findings = self._findings
        findings.only(element, ("comment", "field", "ref"))
        findings.known_attributes(element, ("name",))
        name = findings.name(element, "a message", frozenset(), "DoSomething")
        comment = findings.loose_comment(element, f"message '{name}'" if name else "a message")
        scope = NameScope(findings)
        fields = [
            read_field(child, self._enums, RESERVED_IN_MESSAGES, scope, findings)
            for child in element.find_all("field")
        ]
        for child in element.find_all("ref"):
            findings.only(child, ())
            field = find_field(child, self._fields, findings)
            if field is not None and scope.add(child, "field", field.name):
                fields.append(field)
        if name is None or not self._fits(element, name):
            return None
        placed, datasize = place_fields(field for field in fields if field is not None)
        return MessageSchema(message_type_name(name), datasize, placed, comment)

    def _fits(self, element: Element, name: str) -> bool:
        """Return whether a message's name is short enough and unique."""
        longest = MAX_MESSAGE_LENGTH - len(MESSAGE_SUFFIX)
        if len(name) > longest:
            self._findings.error(
                element,
                f"the message name '{name}' has {len(name)} characters, the limit is {longest}",
                f"shorten it: with the suffix {MESSAGE_SUFFIX} it must fit into {MAX_MESSAGE_LENGTH}",
                "name",
            )
            return False
        return self._scope.add(element, "message", message_type_name(name), name)
