"""The domain model of the built-in core: types, errors, functions."""

from __future__ import annotations

import pytest

from cxbridge.executive.host.values import FALSE, TRUE
from tests.executive.core.core_domain import DomainBench

ERRORS = {
    "type-of-object-does-not-exist": (
        ["(domain-object (name R) (type robot))"],
        "Type robot of object R does not exist.",
    ),
    "super-type-does-not-exist": (
        ["(domain-object-type (name robot) (super-type thing))"],
        "Super-type thing of type robot does not exist.",
    ),
    "operator-of-action-does-not-exist": (
        ["(plan-action (id 1) (action-name fly))"],
        "Operator of action fly does not exist",
    ),
    "precondition-must-have-predicate-or-be-equality": (
        ["(pddl-predicate (id p1))"],
        "pddl-predicate p1 must have a predicate",
    ),
    "value-predicate-without-paired-effect": (
        [
            "(domain-predicate (name door) (value-predicate TRUE))",
            "(domain-effect (name e) (part-of open) (predicate door) (param-names d v))",
        ],
        "Effect e of operator open on door (d) is not matched with a complementary effect",
    ),
}


@pytest.mark.parametrize("kind", ERRORS)
def test_domain_errors_are_reported(kind: str) -> None:
    facts, message = ERRORS[kind]
    bench = DomainBench()
    bench.assert_all(*facts)
    bench.env.run()
    assert bench.one("domain-error", error_type=kind)["error-msg"] == message
    assert f"Domain error '{kind}': {message}" in bench.texts("E")


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (
            "(domain-fact-key said (create$ n t) (create$ peggy hello))",
            ("said", "args?", "n", "peggy", "t", "hello"),
        ),
        ("(domain-fact-key locked (create$) (create$))", ("locked",)),
        ("(domain-fact-args (create$ n) (create$ peggy))", ("args?", "n", "peggy")),
        ("(domain-fact-args (create$) (create$))", ()),
        ("(domain-param-value-for-name (create$ 1 2) (create$ a b) b)", 2),
        ("(domain-param-value-for-name (create$ 1 2) (create$ a b) c)", FALSE),
        (
            "(domain-build-ground-parameter-list (create$ x c) (create$ nil K) (create$ x) (create$ 1))",
            (1, "K"),
        ),
        (
            "(domain-check-grounding-match (create$ x) (create$ 1) (create$) (create$ x) (create$ 1))",
            TRUE,
        ),
        (
            "(domain-check-grounded-equality (create$ x y) (create$) (create$ x y) (create$ 1 1))",
            TRUE,
        ),
        ("(domain-ground-effect (create$ x z c) (create$ nil nil x) (create$ x) (create$ 1))", (1, "z", "x")),
        ("(intersect (create$ a b c) (create$ c a))", ("a", "c")),
    ],
)
def test_functions_of_domain_model(call: str, expected: object) -> None:
    assert DomainBench().env.eval(call) == expected


@pytest.mark.parametrize("function", ["(domain-fact-key p", "(domain-fact-args"])
def test_names_without_values_are_an_error(function: str) -> None:
    bench = DomainBench()
    assert bench.env.eval(f"{function} (create$ a b) (create$ 1))") == FALSE
    assert len(bench.texts("E")) == 1
