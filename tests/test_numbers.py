"""Numbers in texts of users, clients and files."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest

from cxbridge.numbers import MAX_DIGITS, parse_decimal
from tests.support import module_files


@pytest.mark.parametrize(
    ("text", "number"),
    [
        *(("0", 0), ("007", 7), ("9" * MAX_DIGITS, 10**MAX_DIGITS - 1)),
        *(
            (text, None)
            for text in ("", "-1", "+1", "1.0", " 1", "1_000", "x", "²", "٣", "9" * (MAX_DIGITS + 1))
        ),
        ("9" * 5000, None),
    ],
)
def test_parse_decimal(text, number):
    assert parse_decimal(text) == number


DIGIT_TESTS = ("isdecimal", "isdigit", "isnumeric")


def texts_in_calls(function: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield the name of the called function and its text, of tests for digits and conversions to numbers."""
    for call in ast.walk(function):
        if isinstance(call, ast.Call):
            if isinstance(call.func, ast.Attribute) and call.func.attr in DIGIT_TESTS:
                yield "test", ast.unparse(call.func.value)
            elif ast.unparse(call.func) == "int" and len(call.args) == 1:
                yield "int", ast.unparse(call.args[0])


def test_only_parse_decimal_converts_tested_digits():
    """Each further conversion forgets the length, or the digits of non-Latin scripts."""
    found = set()
    for module, path in module_files().items():
        for function in ast.walk(ast.parse(path.read_text())):
            if isinstance(function, ast.FunctionDef):
                calls = set(texts_in_calls(function))
                found |= {module for kind, text in calls if kind == "test" and ("int", text) in calls}
    assert found == {"cxbridge.numbers"}
