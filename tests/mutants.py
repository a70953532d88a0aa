"""Changes the program at points drawn by a seed, and tells which changes the tests notice.

``python -m tests.mutants --seed 1 --count 60 --report before.json`` writes one change at a time into the tree
of the current folder, runs the test files that cover the changed module, and takes the change back. The same
code and seed give the same changes: two reports compare two sets of tests.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from cxbridge.cli.console import say_text as say

_FLIPPED: Final[dict[type[ast.cmpop], str]] = {
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Lt: ">=",
    ast.GtE: "<",
    ast.Gt: "<=",
    ast.LtE: ">",
    ast.In: "not in",
    ast.NotIn: "in",
    ast.Is: "is not",
    ast.IsNot: "is",
}


@dataclass(frozen=True)
class Mutant:
    """A change of one module.

    :ivar span: of the bytes that are replaced.
    """

    file: str
    line: int
    kind: str
    span: tuple[int, int]
    old: str
    new: str

    def apply(self, source: bytes) -> bytes:
        """Return the module's source with the change."""
        begin, end = self.span
        return source[:begin] + self.new.encode() + source[end:]


class _Points(ast.NodeVisitor):
    """Collects the possible changes of a module."""

    def __init__(self, file: str, source: bytes) -> None:
        self._file, self._source = file, source
        self._starts = [0]
        for line in source.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))
        self.found: list[Mutant] = []

    def _add(self, node: ast.expr | ast.stmt, kind: str, new: str) -> None:
        begin = self._starts[node.lineno - 1] + node.col_offset
        end = self._starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)
        old = self._source[begin:end].decode()
        self.found.append(Mutant(self._file, node.lineno, kind, (begin, end), old, new))

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        for each in node.body:
            self.visit(each)

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> None:
        self.visit_FunctionDef(node)

    def visit_If(self, node: ast.If) -> None:
        if "TYPE_CHECKING" not in ast.unparse(node.test):
            self._add(node.test, "condition negated", f"(not ({ast.unparse(node.test)}))")
            self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            self._add(node, "call removed", "pass")
            self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._add(node, "change removed", "pass")
        self.generic_visit(node)

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None and not (isinstance(node.value, ast.Constant) and node.value.value is None):
            self._add(node, "nothing returned", "return None")
            self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        if len(node.ops) == 1:
            left, right = ast.unparse(node.left), ast.unparse(node.comparators[0])
            self._add(node, "comparison flipped", f"({left} {_FLIPPED[type(node.ops[0])]} {right})")
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        word = " or " if isinstance(node.op, ast.And) else " and "
        text = word.join(f"({ast.unparse(each)})" for each in node.values)
        self._add(node, "and, or exchanged", f"({text})")
        self.generic_visit(node)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Texts stay as they are."""

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, bool):
            self._add(node, "constant changed", str(not node.value))
        elif isinstance(node.value, int | float):
            self._add(node, "constant changed", str(node.value + 1))


def points(root: Path) -> list[Mutant]:
    """Return all possible changes of the packages below a checkout, in order."""
    found: list[Mutant] = []
    for package in (root / "cxbridge", *sorted((root / "plugins").glob("*/cxbridge_*"))):
        for path in sorted(package.rglob("*.py")):
            source = path.read_bytes()
            visitor = _Points(path.relative_to(root).as_posix(), source)
            visitor.visit(ast.parse(source))
            found += visitor.found
    return found


def tests_of(root: Path, file: str, most: int) -> list[str]:
    """Return the test files for a module, at most so many.

    Those of the module's name come first, then those that import it, then the others of its folder.
    """
    module = file.removesuffix(".py").removesuffix("/__init__")
    parts = module.split("/")
    if parts[0] == "plugins":
        folder = root.joinpath(
            *parts[:2], "tests", f"{parts[1].removeprefix('cxbridge-')}_tests", *parts[3:-1]
        )
        dotted = ".".join(parts[2:])
    else:
        folder = root.joinpath("tests", *parts[1:-1])
        dotted = ".".join(parts)
    while not folder.is_dir():
        folder = folder.parent
    ranked: list[tuple[int, str]] = []
    for path in _test_files(root):
        near = path.is_relative_to(folder)
        text = path.read_text()
        if path.name == f"test_{parts[-1]}.py" and near:
            rank = 0
        elif f"{dotted} import" in text or f"{dotted}." in text:
            rank = 1 if near else 2
        elif path.parent == folder:
            rank = 3
        elif near:
            rank = 4
        else:
            continue
        ranked.append((rank, path.relative_to(root).as_posix()))
    return [name for _, name in sorted(ranked)[:most]]


def _test_files(root: Path) -> Iterator[Path]:
    for folder in (root / "tests", *sorted((root / "plugins").glob("*/tests"))):
        yield from sorted(folder.rglob("test_*.py"))


def verdict(root: Path, files: list[str], timeout: float) -> str:
    """Run test files until one fails: ``killed``, ``survived`` or ``timeout``."""
    call = [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider", *files]
    process = subprocess.Popen(
        call, cwd=root, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        return "survived" if process.wait(timeout) in (0, 5) else "killed"
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, 9)
        process.wait()
        return "timeout"


def try_out(root: Path, mutant: Mutant, files: list[str], timeout: float) -> str:
    """Return what the tests say of a changed program; the program is afterwards as before."""
    path = root / mutant.file
    source = path.read_bytes()
    try:
        path.write_bytes(mutant.apply(source))
        return verdict(root, files, timeout) if files else "no tests"
    finally:
        path.write_bytes(source)


def main() -> None:
    """Try the changes out, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--most-files", type=int, default=10, help="test files that are run for a change")
    parser.add_argument(
        "--timeout", type=float, default=300.0, help="seconds; a change that hangs is noticed"
    )
    parser.add_argument(
        "--report", type=Path, help="a file for the verdicts, as JSON; what is in it is not run again"
    )
    options = parser.parse_args()
    root = Path.cwd()
    report: Path | None = options.report
    rows = json.loads(report.read_text()) if report and report.exists() else []
    for mutant in random.Random(options.seed).sample(points(root), options.count)[len(rows) :]:
        begun = time.monotonic()
        files = tests_of(root, mutant.file, options.most_files)
        said = try_out(root, mutant, files, options.timeout)
        rows.append({**asdict(mutant), "tests": files, "verdict": said})
        say(f"{said:9} {time.monotonic() - begun:5.0f} s  {mutant.file}:{mutant.line} {mutant.kind}")
        if report:
            report.write_text(json.dumps(rows, indent=1))
    say(f"{sum(row['verdict'] in ('killed', 'timeout') for row in rows)} of {len(rows)} noticed")


if __name__ == "__main__":
    main()
