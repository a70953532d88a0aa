"""The entry points: files, and any text at all."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import (
    PddlSyntaxError,
    domain_facts,
    load_domain,
    parse_domain,
    parse_formula,
)
from tests.executive.pddl.texts import GARDEN
from tests.support import many

patient = settings(max_examples=many(100, 25), deadline=None, suppress_health_check=[HealthCheck.too_slow])


def test_unreadable_files_are_an_error(tmp_path: Path) -> None:
    for path, message in ((tmp_path / "gone.pddl", "no such file"), (tmp_path, "is a directory")):
        with pytest.raises(PddlError, match=message) as caught:
            load_domain(path)
        assert caught.value.file == str(path)


def test_semantic_errors_have_file_line_and_column() -> None:
    with pytest.raises(PddlError) as caught:
        parse_domain(GARDEN.replace("(held ?t)\n", "(held ?x)\n"), "garden.pddl")
    assert str(caught.value).startswith("garden.pddl:13:25: Unknown Parameter ?x\n  hint: ")


BRACKETS = ["(", ")", "(?x)", ";", "\n"]
SECTIONS = [
    "(define (domain",
    "(:action",
    ":parameters",
    ":effect",
    ":precondition",
    "(:types",
    "(:predicates",
]
FORMULAS = ["and", "not", "(not", "(exists", "(when", "(at start", "(= ?x"]
WORDS = ["?", "-", "(either", "a", "?x", "3"]
PIECES = st.sampled_from([*BRACKETS, *SECTIONS, *FORMULAS, *WORDS])


@patient
@given(st.lists(PIECES, max_size=30).map(" ".join) | st.text(max_size=60), st.booleans())
def test_random_text_is_domain_or_one_error(text: str, fawkes_compat: bool) -> None:
    with contextlib.suppress(PddlError):
        domain_facts(parse_domain(text, fawkes_compat=fawkes_compat), fawkes_compat=fawkes_compat)


@patient
@given(st.data())
def test_damaged_domain_is_domain_or_one_error(data: st.DataObject) -> None:
    start = data.draw(st.integers(0, len(GARDEN)))
    end = data.draw(st.integers(start, min(len(GARDEN), start + 30)))
    text = GARDEN[:start] + data.draw(PIECES) + GARDEN[end:]
    with contextlib.suppress(PddlError):
        domain_facts(parse_domain(text))


@pytest.mark.parametrize("nesting", ["(not ", "(and ", "(p (", "(exists (?x) "])
def test_nesting_of_ten_thousand_levels_is_one_error(nesting: str) -> None:
    depth = 10_000 * nesting.count("(")
    closed = nesting * 10_000 + ")" * (depth - (10_000 if "?x" in nesting else 0))
    for parse in (parse_formula, parse_domain):
        with pytest.raises(PddlSyntaxError):
            parse(closed)
