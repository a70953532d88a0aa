"""docs/evidence/proofs.md names existing tests."""

from __future__ import annotations

import re

from tests.support import ROOT

TEXT = (ROOT / "docs" / "evidence" / "proofs.md").read_text()
FOLDERS = (ROOT, ROOT / "tests", ROOT / "tests" / "executive", *ROOT.glob("plugins/*/tests/*_tests"))
PLANNING = ROOT / "plugins" / "cxbridge-planning" / "tests" / "planning_tests"
COLUMNS = {2: "feature/test_planner.py", 3: "fawkes/test_plugins.py"}
"""The file of a name without a file, by the column of the table of bad input."""


def test_files_and_tests_exist():
    """Names are `file.py`, `file.py::test`, or `::test` of the file before."""
    missing = []
    text = ""
    for path, name in re.findall(r"`([\w/.*-]+\.py)?(?:::(test_\w+))?`", TEXT):
        if path:
            text = "".join(file.read_text() for folder in FOLDERS for file in folder.glob(path))
        if not text or (f"def {name}(" not in text and name):
            missing.append((path, name))
    assert missing == []


def test_tests_of_columns_exist():
    rows = [line.split("|") for line in TEXT.splitlines() if line.count("|") == 5]
    names = [
        (number, name)
        for row in rows
        for number in COLUMNS
        for name in re.findall(r"`(test_\w+)`", row[number])
    ]
    assert names
    for number, name in names:
        assert f"def {name}(" in (PLANNING / COLUMNS[number]).read_text(), name
