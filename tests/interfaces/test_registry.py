from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.errors import InterfaceDefinitionError, InterfaceError
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.registry import InterfaceRegistry, default_registry
from cxbridge.interfaces.xml.parser import parse_bytes
from tests.interfaces.samples import DATA, definition


def test_first_folder_has_precedence_and_shipped_folder_is_last(tmp_path: Path) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    for folder in (first, second):
        folder.mkdir()
        (folder / "SampleInterface.xml").write_bytes(
            definition(DATA) + folder.name.encode().join([b"<!--", b"-->"])
        )
    (second / "TestInterface.xml").write_bytes(definition(DATA, name="TestInterface"))
    registry = InterfaceRegistry([first, second])
    assert registry.schema("SampleInterface").source == str(first / "SampleInterface.xml")
    assert registry.get("TestInterface").maxlenof("number") == 1
    assert registry.get("TestInterface") is registry.get("TestInterface")
    assert {"SampleInterface", "SkillerInterface"} <= set(registry.names())
    assert registry.dirs[:2] == (first, second)


def test_unknown_type_is_error_with_hint(tmp_path: Path) -> None:
    registry = InterfaceRegistry([tmp_path])
    with pytest.raises(InterfaceError) as caught:
        registry.get("SkilerInterface")
    assert caught.value.message.startswith("Interface of type 'SkilerInterface' not found. ")
    assert str(tmp_path) in caught.value.message
    assert "SkillerInterface" in (caught.value.hint or "")
    with pytest.raises(InterfaceError) as caught:
        registry.get("Skiller")
    assert (caught.value.hint or "").startswith("did you mean SkillerInterface")


@pytest.mark.parametrize("name", ["../SkillerInterface", "", "/etc/passwd", "a b"])
def test_type_name_is_never_path(name: str) -> None:
    with pytest.raises(InterfaceError, match="not found"):
        default_registry().get(name)


def test_registry_reads_requested_types_only(tmp_path: Path) -> None:
    (tmp_path / "WrongInterface.xml").write_text("<interface")
    (tmp_path / "OtherInterface.xml").write_bytes(definition(DATA))
    registry = InterfaceRegistry([tmp_path])
    assert registry.get("SwitchInterface").SCHEMA.name == "SwitchInterface"
    with pytest.raises(InterfaceDefinitionError, match="not well-formed"):
        registry.get("WrongInterface")
    with pytest.raises(InterfaceDefinitionError, match="defines SampleInterface, not OtherInterface"):
        registry.get("OtherInterface")


def test_class_can_be_added() -> None:
    registry = InterfaceRegistry(shipped=False)
    interface = make_interface_class(parse_bytes(definition(DATA)))
    registry.add(interface)
    assert registry.get("SampleInterface") is interface
    assert registry.schema("SampleInterface") is interface.SCHEMA
