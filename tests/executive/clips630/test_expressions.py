"""Every function of CLIPS 6.30 with arguments of all types, compared with our environment."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.executive.clips630 import engines, expressions
from tests.executive.clips630.engines import CRASH, OurEngine, Outcome, needs_clips630
from tests.executive.clips630.known import KNOWN, Known, find
from tests.support import many

pytestmark = needs_clips630

SEEDS = range(many(8, 1))
EACH = many(40, 4)
CHUNK = 500


@pytest.fixture
def ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    ours = OurEngine()
    yield ours
    ours.close()


def describe_difference(text: str, reference: Outcome, outcome: Outcome) -> str:
    lines = [
        f"  {aspect}: {getattr(reference, aspect)!r}, ours: {getattr(outcome, aspect)!r}"
        for aspect in reference.differences(outcome)
    ]
    return "\n".join([text, *lines, f"  6.30 says: {reference.text}", f"  ours says: {outcome.text}"])


@pytest.mark.parametrize("seed", SEEDS)
def test_functions_match_clips_6_30(seed: int, ours: OurEngine, tmp_path: Path) -> None:
    texts = list(expressions.generate(expressions.functions(tmp_path), seed, EACH))
    assert len(texts) > 4000
    new = []
    for start in range(0, len(texts), CHUNK):
        chunk = texts[start : start + CHUNK]
        for text, reference in zip(chunk, engines.run_6_30(chunk, tmp_path), strict=True):
            if reference is CRASH:
                continue  # ours must not, and has nothing to be compared with
            outcome = ours.outcome(start, text)
            differing = reference.differences(outcome)
            if differing and not find(text, reference, outcome):
                new.append(describe_difference(text, reference, outcome))
    assert not new, f"{len(new)} new differences, e.g.\n" + "\n".join(new[:20])


@pytest.mark.parametrize("row", KNOWN, ids=lambda row: row.example)
def test_known_differences_remain(row: Known, ours: OurEngine, tmp_path: Path) -> None:
    [reference] = engines.run_6_30([row.example], tmp_path)
    outcome = ours.outcome(0, row.example)
    assert reference.differences(outcome), "it no longer differs: take the row out"
    assert row.covers(row.example, reference, outcome)
    assert row.reason


MENDED = (
    *(
        "(round 2.5)",
        "(round 3.5)",
        "(round -2.5)",
        "(round 1e300)",
        '(str-index "" "abc")',
        '(str-index "ä" "ä")',
    ),
    *(
        '(string-to-field "?x")',
        '(string-to-field "(")',
        '(string-to-field "$?x y")',
        '(string-to-field "$a")',
    ),
    *(r'(explode$ "a ?x $?y & | ~ (b) => \"s\" 1e3 [i]")', "(nth$ (/ 4 2) (create$ a b))", '(length$ "äö")'),
    *(
        "(sub-string (/ 4 2) (id 3.9) abcdef)",
        "(create$ (random (id 1.0) (id 1.0)) (random 3 3))",
        "(evenp (/ 4 2))",
    ),
    *(
        "(replace$ (create$ a b c) (/ 4 2) 2 x (create$ y z))",
        "(delete$ (create$ a b) (/ 2 2) 1)",
        "(nth 2 (create$ a b))",
    ),
    *(
        '(str-cat (/ 1 3) " " 1e15 " " 100.0)',
        "(implode$ (create$ (/ 1 3) 1e15))",
        '(format nil "%s %g %d" abc 1e15 3.7)',
    ),
    *(
        "(sym-cat 1e16 -0.0)",
        "(duplicate 1 (a 1))",
        "(duplicate 1 (m [c1] (instance-address [c1])))",
        "(modify 1 (a [c1]))",
    ),
    *(
        "(modify 3 (implied x))",
        "(modify 99 (a 1))",
        "(duplicate 99 (a 1))",
        "(length$ [c1])",
        "(insert$ (create$ a) (id 1.0) b c)",
        "(subseq$ (create$ a b c) (id 2.0) (/ 6 2))",
    ),
    *(
        "(mv-append a b)",
        "(member b (create$ a b))",
        '(wordp "a")',
        "(str-compare abcd abce (id 3.0))",
        '(str-explode "a ?b")',
    ),
)
"""Expressions with a difference in an earlier version."""


def test_mended_functions_match_clips_6_30(ours: OurEngine, tmp_path: Path) -> None:
    for text, reference in zip(MENDED, engines.run_6_30(MENDED, tmp_path), strict=True):
        outcome = ours.outcome(0, text)
        assert not reference.differences(outcome), describe_difference(text, reference, outcome)


def test_crashes_of_clips_6_30_are_errors(ours: OurEngine) -> None:
    for text in (
        "(duplicate 1 (a (create$ 1 2)))",
        "(modify 1 (a (create$)))",
        "(mod -9223372036854775808 (id -1))",
    ):
        outcome = ours.outcome(0, text)
        assert outcome.error, text
