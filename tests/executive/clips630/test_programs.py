"""Programs: the same lines printed, in the same order, and the same facts in the end, as in CLIPS 6.30."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import pytest

from tests.executive.clips630 import engines
from tests.executive.clips630.engines import OurEngine, needs_clips630
from tests.executive.clips630.programs import program
from tests.support import many

pytestmark = needs_clips630

FILES = sorted((Path(__file__).parent / "programs").glob("*.clp"))
LIMIT = 150
"""Firings: some programs go round in circles."""


def in_6_30(file: Path, folder: Path) -> list[str]:
    commands = [
        f'(load "{file}")',
        '(printout t crlf "@go" crlf)',
        "(reset)",
        f"(run {LIMIT})",
        "(facts)",
        "(agenda)",
    ]
    output = engines.execute(commands, folder)
    return kept(output.partition("@go\n")[2].split("\n"))


def in_ours(file: Path) -> tuple[list[str], list[str]]:
    with closing(OurEngine(None)) as ours:
        assert ours.env.load(file), ours.env.loader.diagnostics
        ours.env.eval("(reset)")
        ours.env.run(LIMIT)
        ours.env.eval("(facts)")
        ours.env.eval("(agenda)")
        return kept(ours.lines), list(ours.errors)


def kept(lines: list[str]) -> list[str]:
    """Leave out known differences: 6.4 has no initial-fact."""
    return [
        line.rstrip()
        for line in lines
        if line.strip() and "(initial-fact)" not in line and not line.startswith("For a total")
    ]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_program_prints_lines_of_clips_6_30(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    lines, errors = in_ours(file)
    assert lines == in_6_30(file, tmp_path)
    assert not errors


@pytest.mark.parametrize("seed", range(many(2000, 20)))
def test_random_program_fires_rules_of_clips_6_30(seed: int, tmp_path: Path) -> None:
    file = tmp_path / "program.clp"
    file.write_text(program(seed))
    lines, errors = in_ours(file)
    assert lines == in_6_30(file, tmp_path), file.read_text()
    assert not errors
