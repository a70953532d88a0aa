"""The examples of docs/check-codes.md: files of an agent with a mistake, and the output of the check."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from cxbridge.run import RunOptions
from cxbridge_studio.check.run import check
from tests.support import ROOT

PAGE = ROOT / "docs" / "check-codes.md"
PROGRAM = "program.clp"
"""The name of a file that is checked alone."""
_FENCE = re.compile(r"(?:`(?P<file>[\w./-]+)`:\n\n)?```(?P<language>\w+)\n(?P<text>.*?)```\n", re.DOTALL)
_SECTION = re.compile(r"^## (?P<title>.+?)\n(?P<body>.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Example:
    """A section of the page.

    :param files: the files that replace files of the correct agent.
    :param output: the output of the check.
    """

    title: str
    files: dict[str, str]
    output: str


def load_examples() -> list[Example]:
    """Return the sections of the page; the first section has the correct agent."""
    result = []
    for section in _SECTION.finditer(PAGE.read_text()):
        fences = list(_FENCE.finditer(section["body"]))
        files = {fence["file"]: fence["text"] for fence in fences if fence["file"]}
        output = "".join(fence["text"] for fence in fences if fence["language"] == "text")
        result.append(Example(section["title"], files, output))
    return result


def run_check(files: dict[str, str], folder: Path, *, portable: bool = False) -> str:
    """Return the output of the check for an agent, with the file names of the page.

    :param portable: whether the check includes portability.
    """
    (folder / "lua").mkdir()
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(text)
    program = folder / PROGRAM
    scenario = program if PROGRAM in files else folder
    findings = check(RunOptions(scenario=scenario, skill_dirs=(folder / "lua",)), portable=portable)
    return "".join(f"{finding}\n" for finding in findings).replace(f"{folder}/", "")
