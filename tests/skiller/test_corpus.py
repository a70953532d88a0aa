"""Skill strings that the fuzzer kept (docs/security.md)."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.skiller import skillstring
from fuzz import skills
from fuzz.skills import SKILL_STRINGS, skill_strings

CORPUS = sorted((Path(__file__).parent / "corpus").iterdir())


def test_skiller_accepts_next_skill_string_after_corpus():
    assert len(CORPUS) > 20
    for file in CORPUS:
        skill_strings(file.read_bytes())


def test_fuzz_target_accepts_seeds():
    for seed in SKILL_STRINGS:
        skill_strings(seed)


def test_fuzz_target_finds_difference_from_lua(monkeypatch: pytest.MonkeyPatch):
    """Escapes above 127 as characters would have two bytes."""
    monkeypatch.setattr(skillstring, "from_lua", lambda text: text)
    with pytest.raises(AssertionError, match="makes other calls"):
        skill_strings(b"\0echo'\\255'")


def test_fuzz_target_finds_hanging_skiller(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(skills._Robot, "order", lambda robot, text: ("S_FAILED", "x"))
    with pytest.raises(AssertionError):
        skill_strings(b"\0count{}")
