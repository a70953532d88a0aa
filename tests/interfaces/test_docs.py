"""The documentation's examples about interface types run, and its definition is correct."""

from __future__ import annotations

import re
import textwrap
from typing import Any

import pytest

from cxbridge.interfaces.xml.parser import check_bytes
from tests.support import ROOT

PAGE = (ROOT / "docs" / "blackboard.md").read_text(encoding="utf-8").partition("## Interface types")[2]
LAYOUTS = (ROOT / "docs" / "evidence" / "blackboard.md").read_text(encoding="utf-8")


def test_examples_run(capsys: pytest.CaptureFixture[str]) -> None:
    for example in re.findall(r"```python\n(.*?)```", PAGE + LAYOUTS, re.DOTALL):
        names: dict[str, Any] = {}
        exec(compile(example, "docs/blackboard.md", "exec"), names)
    assert capsys.readouterr().out.startswith("say{text='hello'} 1040\n2 S_FINAL\n")


def test_definition_is_correct() -> None:
    match = re.search(r"^    <\?xml.*?</interface>", PAGE, re.DOTALL | re.MULTILINE)
    assert match
    result = check_bytes(textwrap.dedent(match.group()).encode())
    assert (result.errors, result.warnings) == ((), ())
    assert result.schema
    assert [field.name for field in result.schema.messages[0].fields] == ["seconds", "colour"]
