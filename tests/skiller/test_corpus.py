"""What a fuzzer found worth keeping of skill strings (docs/security.md), once more."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.skiller import skillstring
from fuzz import skills
from fuzz.skills import SKILL_STRINGS, skill_strings

CORPUS = sorted((Path(__file__).parent / "corpus").iterdir())


def test_whatever_the_skill_string_the_skiller_takes_the_next_one():
    assert len(CORPUS) > 20
    for file in CORPUS:
        skill_strings(file.read_bytes())


def test_the_seeds_do_no_harm():
    for seed in SKILL_STRINGS:
        skill_strings(seed)


def test_what_lua_reads_otherwise_is_found_out(monkeypatch: pytest.MonkeyPatch):
    """Escapes above 127 taken for characters would be two bytes."""
    monkeypatch.setattr(skillstring, "from_lua", lambda text: text)
    with pytest.raises(AssertionError, match="is other calls"):
        skill_strings(b"\0echo'\\255'")


def test_a_skiller_that_does_not_go_on_is_found_out(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(skills._Robot, "order", lambda robot, text: ("S_FAILED", "x"))
    with pytest.raises(AssertionError):
        skill_strings(b"\0count{}")
