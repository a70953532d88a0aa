"""Runs the same CLIPS commands in CLIPS 6.30 and in our environment, and compares the outcomes."""

from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import ClipsError
from cxbridge.events import Event, EventBus, Level, LogLine
from cxbridge.executive.host.environment import ClipsEnvironment

PROGRAM = shutil.which("clips")
WORLD = Path(__file__).with_name("world.clp")

_CODE = re.compile(r"\[([A-Z]+\d+)\]\s*(.*)", re.DOTALL)
_KINDS = (
    ("number of arguments", re.compile(r"expected (?:exactly|at least|no more|at most)|argument\(s\)")),
    (
        "type of an argument",
        re.compile(
            r"to be of type|expected argument|expected a fact|must be|Illegal use|Illegal logical name"
        ),
    ),
    ("no such function", re.compile(r"Missing function declaration")),
    ("no such thing", re.compile(r"Unable to find|[Nn]o such|does not exist|not exist in")),
    ("division by zero", re.compile(r"[Dd]ivide by zero")),
    (
        "syntax",
        re.compile(r"Syntax Error|[Ss]yntax|Expected a|Missing|not allowed|already parsed|Unrecognized"),
    ),
)


def is_6_30() -> bool:
    """Whether the program exists, and is CLIPS 6.30."""
    if PROGRAM is None:
        return False
    banner = subprocess.run([PROGRAM], input="(exit)\n", capture_output=True, text=True, check=False)
    return "CLIPS (6.30" in banner.stdout


needs_clips630 = pytest.mark.skipif(not is_6_30(), reason="Debian's package clips (CLIPS 6.30) is absent")


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of an expression.

    :param error: kind of the first error; empty when there was none.
    :param done: whether the rest of the command is evaluated.
    :param value: type and printed form of the value; empty when not done.
    :param printed: output of the expression; not compared after an error.
    :param world: facts, instances and agenda afterwards.
    :param text: the text of the error.
    """

    error: str
    done: bool
    value: tuple[str, str]
    printed: str
    world: str
    text: str

    def differences(self, other: Outcome) -> tuple[str, ...]:
        """Name the aspects in which two outcomes differ."""
        names = ("error", "done", "value", *(() if self.error or other.error else ("printed",)), "world")
        return tuple(name for name in names if getattr(self, name) != getattr(other, name))


CRASH = Outcome("crash", False, ("", ""), "", "", "the process ended")


def kind_of(text: str) -> str:
    """Return the kind of the error in CLIPS' message: 6.30 and 6.4 have different words and codes."""
    match = _CODE.search(text)
    for kind, pattern in _KINDS:
        if pattern.search(match[2] if match else text):
            return kind
    return match[1] if match else text


def _section(lines: Sequence[str], begin: str, end: str) -> list[str]:
    try:
        first = next(i for i, line in enumerate(lines) if line.startswith(begin))
        last = next(i for i in range(first, len(lines)) if lines[i].startswith(end))
    except StopIteration:
        return []
    return list(lines[first + 1 : last])


def _world(lines: Sequence[str]) -> str:
    kept = [
        line.rstrip()
        for line in _section(lines, "@facts", "@end")
        if "(initial-fact)" not in line
        and "[initial-object]" not in line
        and not line.startswith("For a total")
    ]
    return "\n".join(kept)


def outcome(lines: Sequence[str], error_text: str = "") -> Outcome:
    """Make an outcome of the output from ``@begin`` to ``@end``, which may contain errors."""
    printed = "\n".join(_section(lines, "@begin", "@value"))
    found = re.search(r"\[[A-Z]+\d+\] ", printed)
    if found and not error_text:
        error_text, printed = printed[found.start() :], printed[: found.start()]
    head = next((line for line in lines if line.startswith("@value ")), "@value FALSE ?").split()
    done = head[1] == "TRUE"
    value = (head[2], "\n".join(_section(lines, "@value", "@facts"))) if done else ("", "")
    return Outcome(
        kind_of(error_text), done, value, printed.strip(), _world(lines), " ".join(error_text.split())
    )


def command(expression: str) -> str:
    """Return the command that evaluates the expression and keeps its value."""
    return f"(progn (bind ?*v* {expression}) (bind ?*done* TRUE))"


def run_6_30(expressions: Sequence[str], folder: Path) -> list[Outcome]:
    """Evaluate the expressions in CLIPS 6.30; an expression that ends the program gets :data:`CRASH`."""
    outcomes: list[Outcome] = []
    while len(outcomes) < len(expressions):
        outcomes += _run_6_30(expressions[len(outcomes) :], folder)
        if len(outcomes) < len(expressions):
            outcomes.append(CRASH)
    return outcomes


def _run_6_30(expressions: Sequence[str], folder: Path) -> list[Outcome]:
    parts = [f"(begin {n})\n{command(e)}\n(finish)" for n, e in enumerate(expressions)]
    output = execute([f'(load "{WORLD}")', *parts], folder)
    outcomes = []
    for block in re.split(r"^(?=@begin \d)", output, flags=re.MULTILINE)[1:]:
        lines = [line for line in block.split("\n") if line.strip()]
        if "@end" not in lines:
            break
        outcomes.append(outcome(lines))
    return outcomes


def execute(commands: Iterable[str], folder: Path, seconds: int = 120) -> str:
    """Run commands in CLIPS 6.30 and return the output."""
    assert PROGRAM is not None
    batch = folder / "batch.clp"
    batch.write_text("\n".join([*commands, "(exit)", ""]), encoding="utf-8")
    done = subprocess.run(
        [PROGRAM, "-f2", str(batch)],
        capture_output=True,
        cwd=folder,
        timeout=seconds,
        stdin=subprocess.DEVNULL,
        check=False,
    )
    return done.stdout.decode("utf-8", "surrogateescape")


class OurEngine:
    """Our environment and its output.

    :param world: file to load first.
    """

    def __init__(self, world: Path | None = WORLD) -> None:
        bus = EventBus(VirtualClock())
        bus.subscribe(self._take, LogLine)
        self.lines: list[str] = []
        self.errors: list[str] = []
        self.env = ClipsEnvironment("executive", bus)
        if world is not None and not self.env.load(world):
            raise AssertionError(self.env.loader.diagnostics)
        self._end_errors = self.env.output.end_error_capture
        self.env.output.end_error_capture = self._keep_errors  # type: ignore[method-assign]

    def _keep_errors(self, outer: list[str] | None) -> str:
        """Keep the messages of errors that do not end an evaluation, too."""
        text = self._end_errors(outer)
        if text.strip():
            self.errors.append(text)
        return text

    def _take(self, event: Event) -> None:
        assert isinstance(event, LogLine)
        if event.level is Level.ERROR:
            self.errors.append(event.text)
        else:
            self.lines += event.text.split("\n")

    def outcome(self, number: int, expression: str) -> Outcome:
        """Evaluate an expression."""
        self.lines.clear()
        self.errors.clear()
        self.env.eval(f"(begin {number})")
        with contextlib.suppress(ClipsError):
            self.env.eval(command(expression))
        errors = "\n".join(self.errors)
        self.env.eval("(finish)")
        return outcome(self.lines, errors)

    def close(self) -> None:
        """Free it."""
        self.env.destroy()
