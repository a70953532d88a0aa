from __future__ import annotations

import sys
from enum import IntEnum
from typing import Any

import pytest

from cxbridge.errors import InterfaceError
from cxbridge.interfaces import InterfaceRegistry, default_registry
from cxbridge.interfaces.classes import make_interface_class, make_view
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.xml.parser import parse_bytes
from tests.interfaces.samples import DATA, bare, definition


def test_class_has_members_of_fawkes_class() -> None:
    from cxbridge.interfaces import NavigatorInterface as Navigator

    assert issubclass(Navigator, Interface)
    assert issubclass(Navigator.PlaceGotoMessage, Message)
    assert Navigator.MESSAGES["PlaceGotoMessage"] is Navigator.PlaceGotoMessage
    assert issubclass(Navigator.DriveMode, IntEnum)
    assert Navigator.AllowBackward is Navigator.DriveMode.AllowBackward
    assert Navigator.ERROR_UNKNOWN_PLACE == 4
    assert Navigator.maxlenof("target_frame") == 64


def test_messages_take_fields_by_position_and_keyword() -> None:
    from cxbridge.interfaces import NavigatorInterface as Navigator

    message = Navigator.CartesianGotoWithFrameMessage(1.5, 2, target_frame="map")
    assert message.as_dict() == {"x": 1.5, "y": 2.0, "orientation": 0.0, "target_frame": "map"}
    assert Navigator.SetDriveModeMessage(Navigator.Backward).drive_mode is Navigator.Backward
    with pytest.raises(InterfaceError, match=r"PlaceGotoMessage\.place"):
        Navigator.PlaceGotoMessage(3)  # type: ignore[arg-type]


def test_reserved_names_get_underscore() -> None:
    constants = (
        "<constants>"
        '<constant type="int8" name="set" value="1">c</constant>'
        '<enum name="E"><comment>c</comment><item name="get">c</item><item name="mro">c</item></enum>'
        "</constants>"
    )
    interface: Any = make_interface_class(parse_bytes(definition(constants, DATA)))
    assert bare(interface).get("number") == 0
    assert (interface.set_, interface.get_, interface.E.mro_) == (1, interface.E.get, 1)


def test_layout_is_that_of_c_struct() -> None:
    for name in default_registry().names():
        schema = default_registry().schema(name)
        make_view(schema.fields, schema.datasize)
        for message in schema.messages:
            make_view(message.fields, message.datasize)
    with pytest.raises(InterfaceError, match="C struct"):
        make_view(schema.fields, schema.datasize + 8)


def test_import_of_package_parses_no_definitions() -> None:
    import subprocess

    code = "import sys, cxbridge.interfaces; print('cxbridge.interfaces.registry' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


def test_all_shipped_types_can_be_imported() -> None:
    import cxbridge.interfaces as package

    for name in default_registry().names():
        assert getattr(package, name) is default_registry().get(name)
        assert name in dir(package)
    with pytest.raises(AttributeError, match="NoSuchInterface"):
        package.NoSuchInterface  # noqa: B018
    with pytest.raises(AttributeError, match="something"):
        package.something  # noqa: B018
    assert package.InterfaceRegistry is InterfaceRegistry
