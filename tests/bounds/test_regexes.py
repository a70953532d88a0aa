"""No regular expression of the package backtracks without a bound: a text of a thousand pieces takes no time.

The expressions are those that the modules of the package compile when they are imported, and the literals in
calls of re in its files. An expression is tried with the methods that the package calls on it, and with texts
that are made of the expression.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

from tests.bounds.attacks import attacks, seconds
from tests.support import ROOT, many

MOST_S = 0.2
"""Processor time for one text; a linear expression takes microseconds, a quadratic one milliseconds."""

FEW = (14, 20, 26, 32, 38, 44, 150)
MANY = (300, 600, 1000)
SOON_S = 0.002
"""Processor time for a text of the last of FEW; only an expression that takes longer is tried with MANY."""

WHOLE, PARTS = "fullmatch", "search"
ANCHORED = {"match", "fullmatch"}

_COLLECT = """
import importlib, pkgutil, re, sys
import cxbridge
found, compile_it = set(), re._compile
def collecting(pattern, flags):
    frame = sys._getframe(2)
    if isinstance(pattern, (str, bytes)) and "cxbridge" in frame.f_globals.get("__name__", ""):
        found.add((pattern, int(flags), frame.f_code.co_filename, frame.f_lineno))
    return compile_it(pattern, flags)
re._compile = collecting
for module in pkgutil.walk_packages(cxbridge.__path__, "cxbridge."):
    if not module.name.endswith("__main__"):
        try:
            importlib.import_module(module.name)
        except ImportError:
            pass
re._compile = compile_it
print(repr(sorted(found, key=repr)))
"""


@cache
def tree_of(path: str) -> ast.Module:
    return ast.parse(Path(path).read_text())


@cache
def methods_by_name(path: str = "") -> dict[str, set[str]]:
    """Return the names of methods that are called on each name of a file; empty: of the package."""
    found: dict[str, set[str]] = {}
    for each in [path] if path else map(str, (ROOT / "cxbridge").rglob("*.py")):
        for node in ast.walk(tree_of(each)):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                found.setdefault(node.value.id, set()).add(node.attr)
    return found


def methods_of(path: str, line: int) -> tuple[str, ...]:
    """Return how the expression that is compiled at a place is tried."""
    for node in tree_of(path).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.lineno <= line <= (node.end_lineno or 0):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            name = getattr(target, "id", "")
            called = methods_by_name(path).get(name) or methods_by_name().get(name, set())
            if called and called <= ANCHORED | {"pattern", "groups"}:
                return (WHOLE,)
    return WHOLE, PARTS


def compiled() -> Iterator[tuple[Any, int, tuple[str, ...]]]:
    """Yield the expressions that modules compile when they are imported, with their flags and methods."""
    done = subprocess.run(
        [sys.executable, "-c", _COLLECT], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for pattern, flags, path, line in ast.literal_eval(done.stdout.splitlines()[-1]):
        yield pattern, flags, methods_of(path, line)


def literals() -> Iterator[tuple[Any, int, tuple[str, ...]]]:
    """Yield the literals in calls of the module re."""
    for path in sorted((ROOT / "cxbridge").rglob("*.py")):
        for node in ast.walk(tree_of(str(path))):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Attribute)
                and getattr(node.func.value, "id", "") == "re"
                and node.func.attr != "compile"
                and node.args
                and isinstance(node.args[0], ast.Constant)
            ):
                yield node.args[0].value, 0, (WHOLE,) if node.func.attr in ANCHORED else (WHOLE, PARTS)


def slow(
    pattern: Any, flags: int, methods: tuple[str, ...] = (WHOLE, PARTS)
) -> tuple[str, int, str, str, str] | None:
    """Return a text that takes an expression too long: the method, the count, and the parts of the text."""
    made = re.compile(pattern, flags)
    for before, piece, end in islice(attacks(pattern, flags), many(10_000, 60)):
        for method in methods:
            for count in (*FEW, *MANY):
                text = before + piece * count + end
                took = seconds(made, method, text)
                if took > MOST_S and seconds(made, method, text) > MOST_S:
                    return method, count, before, piece, end
                if took > MOST_S or (count == FEW[-1] and took < SOON_S):
                    break
    return None


def test_no_expression_of_the_package_backtracks_without_a_bound():
    found = [*compiled(), *literals()]
    assert len(found) > 250
    tried = {(pattern, flags, methods): slow(pattern, flags, methods) for pattern, flags, methods in found}
    assert {expression: text for expression, text in tried.items() if text} == {}


@pytest.mark.parametrize(
    "pattern",
    [
        r"(a+)+b",
    ],
)
def test_an_expression_that_backtracks_is_found(pattern: str):
    assert slow(pattern, 0) is not None
