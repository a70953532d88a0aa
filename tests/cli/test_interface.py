from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from cxbridge.cli.commands.interface import app
from cxbridge.errors import InterfaceDefinitionError, InterfaceError
from cxbridge.interfaces.registry import default_registry
from tests.interfaces.samples import DATA, data_block, definition, measured_rows
from tests.support import SHARED, needs_shared

ROWS = measured_rows()


def run(*arguments: object, status: int = 0) -> str:
    """Run the command; errors are raised as for the program's main()."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if isinstance(result.exception, Exception):
        raise result.exception
    assert result.exit_code == status, result.output
    return result.stdout


def test_list_names_all_types(tmp_path: Path) -> None:
    (tmp_path / "SampleInterface.xml").write_bytes(definition(DATA))
    assert run("list").split() == default_registry().names()
    names = json.loads(run("list", "--json", "--interface-dir", tmp_path))
    assert {"SampleInterface", "SkillerInterface"} <= set(names)


def test_show_prints_layout() -> None:
    text = run("show", "SkillerInterface")
    assert "SkillerInterface: 1216 bytes" in text
    assert "  1208     4  uint32 msgid" in text
    assert "enum SkillStatusEnum: S_INACTIVE=0, S_FINAL=1, S_RUNNING=2, S_FAILED=3" in text
    assert "message ExecSkillMessage: 1040 bytes" in text
    assert "Fawkes knows this layout as" in text


@needs_shared
@pytest.mark.parametrize("row", ROWS, ids=[row["name"] for row in ROWS])
def test_json_of_show_has_shape_of_measured_rows(row: dict[str, Any]) -> None:
    file = SHARED / "fawkes-data" / "interfaces" / Path(row["xml"]).name
    shown = json.loads(run("show", file, "--json"))
    assert {"name", "hash", "datasize", "fields", "messages", "enums", "constants"} <= set(shown)
    for key in set(shown) - {"messages"}:
        assert shown[key] == row[key], key
    assert shown["messages"] == [
        {key: message[key] for key in ("name", "datasize", "fields")} for message in row["messages"]
    ]


def test_check_reports_every_error(tmp_path: Path) -> None:
    file = tmp_path / "SampleInterface.xml"
    file.write_bytes(
        data_block('<field type="uint33" name="a">c</field>', '<field type="int8" name="id" x="">c</field>')
    )
    lines = run("check", file, status=2).splitlines()
    assert lines[0] == f"{file}:3:1: error: unknown type 'uint33'"
    assert lines[2] == f"{file}:4:1: error: 'id' cannot be the name of a <field>: the name is reserved"
    assert lines[3] == f"{file}:4:1: warning: attribute 'x' in <field> is ignored"
    found = json.loads(run("check", file, "--json", status=2))
    assert [(one["severity"], one["line"], one["column"]) for one in found] == [
        ("error", 3, 1),
        ("error", 4, 1),
        ("warning", 4, 1),
    ]


def test_warnings_do_not_change_status(tmp_path: Path) -> None:
    file = tmp_path / "SampleInterface.xml"
    file.write_bytes(definition(DATA, "<extra/>"))
    assert ": warning: <extra> in <interface> is ignored" in run("check", file)


def test_hash_of_file_and_of_fawkes(tmp_path: Path) -> None:
    schema = default_registry().schema("SwitchInterface")
    assert run("hash", "SwitchInterface") == f"{schema.hash_printable}  SwitchInterface\n"
    wire = run("hash", "--wire", "SwitchInterface", "TestInterface").splitlines()
    assert wire[1] == "E4E201A9C8878D3DA3ABC9CDF30F5A33  TestInterface"
    assert wire[0] != f"{schema.hash_printable}  SwitchInterface"


def test_compile_writes_modules_and_stubs(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    output = run("compile", "SwitchInterface", "LedInterface", "-o", folder)
    names = ("SwitchInterface.py", "SwitchInterface.pyi", "LedInterface.py", "LedInterface.pyi")
    assert output.splitlines() == [str(folder / name) for name in names]
    assert "SwitchInterface = make_interface_class" in (folder / "SwitchInterface.py").read_text()
    assert "def __init__(" in (folder / "SwitchInterface.pyi").read_text()
    run("compile", "SwitchInterface", "--stubs", "-o", folder / "stubs")
    assert [path.name for path in (folder / "stubs").iterdir()] == ["SwitchInterface.pyi"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["show", "NoInterface"], "Interface of type 'NoInterface' not found"),
        (["show", "/nowhere/no.xml"], "No such file"),
        (["list", "--interface-dir", "/nowhere"], "no such folder"),
    ],
)
def test_invalid_arguments_are_errors(arguments: list[str], message: str) -> None:
    with pytest.raises((InterfaceError, InterfaceDefinitionError), match=message):
        run(*arguments)
