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
from tests.support import ROOT, many, module_files, share

MOST_S = 0.2
"""Processor time for one text; a linear expression takes microseconds, a quadratic one milliseconds."""

FEW = (14, 20, 26, 32, 38, 44, 150)
MANY = (300, 600, 1000)
SOON_S = 0.002
"""Processor time for a text of the last of FEW; only an expression that takes longer is tried with MANY."""

WHOLE, PARTS = "fullmatch", "search"
ANCHORED = {"match", "fullmatch"}

_COLLECT = """
import importlib, re, sys
import cxbridge
found, compile_it = set(), re._compile
def collecting(pattern, flags):
    frame = sys._getframe(2)
    if isinstance(pattern, (str, bytes)) and "cxbridge" in frame.f_globals.get("__name__", ""):
        found.add((pattern, int(flags), frame.f_code.co_filename, frame.f_lineno))
    return compile_it(pattern, flags)
re._compile = collecting
for module in sys.argv[1:]:
    if not module.endswith("__main__"):
        try:
            importlib.import_module(module)
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
    for file in [path] if path else map(str, module_files().values()):
        for node in ast.walk(tree_of(file)):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                found.setdefault(node.value.id, set()).add(node.attr)
    return found


def methods_of(path: str, line: int) -> tuple[str, ...]:
    """Return the methods with which the expression at a place is tried."""
    for node in tree_of(path).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.lineno <= line <= (node.end_lineno or 0):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            name = getattr(target, "id", "")
            called = methods_by_name(path).get(name) or methods_by_name().get(name, set())
            if called and called <= ANCHORED | {"pattern", "groups"}:
                return (WHOLE,)
    return WHOLE, PARTS


@cache
def compiled() -> tuple[tuple[Any, int, tuple[str, ...]], ...]:
    """Return the expressions that modules compile when they are imported, with their flags and methods."""
    done = subprocess.run(
        [sys.executable, "-c", _COLLECT, *module_files()],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    found = ast.literal_eval(done.stdout.splitlines()[-1])
    return tuple((pattern, flags, methods_of(path, line)) for pattern, flags, path, line in found)


def literals() -> Iterator[tuple[Any, int, tuple[str, ...]]]:
    """Yield the literals in calls of the module re."""
    for path in module_files().values():
        if "import re\n" not in path.read_text():
            continue
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


def slow_attack(
    pattern: Any, flags: int, methods: tuple[str, ...] = (WHOLE, PARTS)
) -> tuple[str, int, str, str, str] | None:
    """Return a text that takes an expression too long: the method, the count, and the parts of the text."""
    made = re.compile(pattern, flags)
    for before, piece, end in islice(attacks(pattern, flags), many(10_000, 24)):
        for method in methods:
            for count in (*FEW, *MANY):
                text = before + piece * count + end
                took = seconds(made, method, text)
                if took > MOST_S and seconds(made, method, text) > MOST_S:
                    return method, count, before, piece, end
                if took > MOST_S or (count == FEW[-1] and took < SOON_S):
                    break
    return None


def test_expressions_of_package_backtrack_within_bound():
    found = [*compiled(), *literals()]
    assert len(found) > 150
    tried = {expression: slow_attack(*expression) for expression in share(found, 80)}
    assert {expression: text for expression, text in tried.items() if text} == {}


QUADRATIC = {
    "texts of programs, which a run or an editor reads": (
        r" \(([^\s()\";&|~?<][^\s()\";&|~<]*)([^()\"]*)\)",
        r"([A-Za-z_]\w*)\s*\{[^}]*\Z",
        r"(\?\*[^\s()&|~]+\*)\s*=",
        r"(\w+)\s*=\s*(\d+)\s*;",
        r"(repeated\s+)?(\w+)\s+(\w+)\s*=\s*(\d+)\s*;",
        r"<<(?P<mark>[#/]?)(?P<name>[A-Za-z0-9_]+)(?:\|(?P<query>.*?))?>>",
        r"\(([\w-]+)\s*([^()]*)\)",
        r"\b([A-Za-z_][\w-]*)\s*[{(]",
        r"do-for-(?:all-)?facts?\b(?=.*\(\s*(?:retract|modify)\b.*:)",
        r"([^\s:|]+):(\d{1,9}):",
        r"mean (.*)\?",
        r"^\s*//[^\n]*\n",
        (
            r"""\bipairs\s*\(?\s*\{([^{}]*)\}\s*\)?\s*do\s+(?:\w+\.)*use_skill"""
            r"""\s*\(\s*["']([^"'\\]*)["']\s*\.\.\s*\w+\s*\)"""
        ),
        r"""\buse_skill\s*\(?\s*["']([^"'\\]*)["']\s*\)?""",
    ),
    "the line before the cursor": (
        r"[?:\w-]*\Z",
        r"[\w/.-]*\Z",
        r"[^\s()\"&|~;]*\Z",
        r"[^\s()\"&|~]*\Z",
    ),
    "a name of a file": (r"(.*?)-([A-Za-z_]\w*+)-(.*)-",),
    "a breakpoint, which is short": (r'\s+log\s+"(.*)"\Z', r"\s+if\s+(?=\()", r"\s+hit\s+(\S+)\Z"),
    "files that the user names: a certificate, a planner's output": (
        r"-----BEGIN CERTIFICATE-----.+?-----END CERTIFICATE-----",
        r"^\s*(?:step\s+)?\d+:\s+(?P<step>[^\s(].*?)\s*$",
    ),
}
"""Expressions that take four times as long for a text of twice the length, and the reason."""

LONG = 8_000
LONG_S = 0.1
"""Processor time for a text of so many pieces; a linear expression takes two milliseconds."""


def is_quadratic(pattern: Any, flags: int, methods: tuple[str, ...] = (WHOLE, PARTS)) -> bool:
    """Return whether an expression takes more than 24 times as long for a text that is 8 times as long."""
    made = re.compile(pattern, flags)
    for before, piece, end in islice(attacks(pattern, flags), 12):
        for method in methods:
            text, longer = (before + piece * count + end for count in (LONG // 8, LONG))
            took = seconds(made, method, text)
            if took > LONG_S / 100 and seconds(made, method, longer) > max(LONG_S, 24 * took):
                return True
    return False


def test_expressions_for_data_take_linear_time():
    known = {pattern for patterns in QUADRATIC.values() for pattern in patterns}
    tried = share((expression for expression in (*compiled(), *literals()) if expression[0] not in known), 80)
    assert [expression for expression in tried if is_quadratic(*expression)] == []


@pytest.mark.parametrize("pattern", [r"(?:\d+\.?\d*|\.\d+)(?:e\d+)?", r"=[^']*\s*"])
def test_quadratic_expression_is_found(pattern: str):
    assert is_quadratic(pattern, 0)


@pytest.mark.parametrize(
    "pattern",
    [
        r"(a+)+b",
    ],
)
def test_backtracking_expression_is_found(pattern: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(f"{__name__}.MOST_S", 0.01)
    assert slow_attack(pattern, 0) is not None
