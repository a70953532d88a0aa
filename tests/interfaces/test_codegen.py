from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from hypothesis import given, settings
from msgspec.structs import replace

from cxbridge.interfaces.codegen import module_source, stub_source
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.registry import default_registry
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.interfaces.xml.parser import parse_bytes, parse_file
from tests.interfaces.samples import bare, schemas
from tests.support import PACKAGES

DATA = Path(__file__).parent / "data"
SAMPLE = DATA / "CompiledInterface.xml"
NAMES = default_registry().names()


def load(source: str, name: str) -> Any:
    module = ModuleType(name)
    exec(compile(source, name, "exec"), vars(module))
    return getattr(module, name)


def test_stub_equals_golden_file() -> None:
    # made by: cxbridge interface compile --stubs tests/interfaces/data/CompiledInterface.xml
    golden = (DATA / "CompiledInterface.pyi.golden").read_text(encoding="utf-8")
    assert stub_source(parse_file(SAMPLE)) == golden


@pytest.mark.parametrize("name", NAMES)
def test_compiled_class_equals_class_from_xml(name: str) -> None:
    schema = default_registry().schema(name)
    compiled = load(module_source(schema), name)
    from_xml: Any = default_registry().get(name)
    assert issubclass(compiled, Interface)
    assert replace(compiled.SCHEMA, source=schema.source) == schema
    assert list(compiled.MESSAGES) == list(from_xml.MESSAGES)
    assert bare(compiled).as_dict() == bare(from_xml).as_dict()


@pytest.mark.parametrize("name", NAMES)
def test_stub_of_shipped_type_is_current(name: str) -> None:
    # made by: cxbridge interface compile --stubs NAME -o cxbridge/interfaces/stubs
    stubs = PACKAGES[0] / "interfaces" / "stubs"
    assert (stubs / f"{name}.pyi").read_text(encoding="utf-8") == stub_source(default_registry().schema(name))
    assert f"{name} as {name}" in (stubs / "__init__.pyi").read_text(encoding="utf-8")


@given(schemas())
@settings(max_examples=25, deadline=None)
def test_generated_schemas_compile(schema: InterfaceSchema) -> None:
    compiled = load(module_source(schema), schema.name)
    assert schema == compiled.SCHEMA
    compile(stub_source(schema), "stub", "exec")


def test_definition_text_is_no_code() -> None:
    evil = '"""; import os; os.abort() #\\'
    data = (
        f"<interface name='AInterface' author='{evil}'><constants><constant type='string' name='S' "
        f"value='{evil}'>{evil}</constant></constants><data><comment>{evil}</comment>"
        f"<field type='int8' name='n'>{evil} {evil} {evil} {evil}</field></data></interface>"
    )
    schema = parse_bytes(data.encode())
    compiled = load(module_source(schema), "AInterface")
    assert schema == compiled.SCHEMA
    assert evil == compiled.S
    compile(stub_source(schema), "stub", "exec")
