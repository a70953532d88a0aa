"""Formulas that would take for ever to evaluate."""

from __future__ import annotations

import pytest

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import parse_formula
from cxbridge.executive.problem.truth import KnownState


def test_formula_with_too_many_choices_is_refused():
    variables = " ".join(f"?v{number}" for number in range(9))
    formula = parse_formula(f"(exists ({variables} - place) (at ?v0 ?v8))")
    with pytest.raises(PddlError, match="cases"):
        formula.holds(KnownState([], {}, lambda _types: [f"p{number}" for number in range(9)]))
