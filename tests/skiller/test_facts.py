"""The rows of docs/evidence/skiller-facts.md name tests."""

from __future__ import annotations

import ast
import re

import pytest

from tests.support import ROOT

PAGE = ROOT / "docs" / "evidence" / "skiller-facts.md"
ROWS = re.findall(r"^\|(.*?)\| (\S+): (\S+) \|$", PAGE.read_text(), re.MULTILINE)


def test_each_row_names_test():
    lines = [line for line in PAGE.read_text().splitlines() if line.startswith("| ") and "---" not in line]
    heads = [line for line in lines if line in ("| fact | test |", "| what | test |")]
    assert len(ROWS) == len(lines) - len(heads) > 80


@pytest.mark.parametrize("file", sorted({file for _, file, _ in ROWS}))
def test_named_tests_exist(file: str):
    tree = ast.parse((ROOT / "tests" / "skiller" / file).read_text())
    defined = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert {test for _, path, test in ROWS if path == file} <= defined
