"""Writes a pytest test that scripts the choices of a run, and fails while the agent lacks a property."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.explore.counterexample_playing import Played
from cxbridge.explore.counterexample_words import skill_of
from cxbridge.properties.monitor import Property
from cxbridge.run.options import RunOptions
from cxbridge.skiller.simulation.estimators import Outcome
from cxbridge.skiller.status import Status
from cxbridge.worlds.points import USUAL

_OPTIONS: Final = (
    "spec",
    "agent",
    "core",
    "fawkes_dir",
    "ros2cx",
    "clips_dirs",
    "interface_dirs",
    "skill_dirs",
    "config",
)
_NO_NAME: Final = re.compile(r"\W+")


def pytest_text(options: RunOptions, played: Played, violated: Property, words: str) -> str:
    """Return the text of a file with the test.

    :param violated: the property.
    :raises CxbridgeError: when a choice is not about a skill: the fixture cannot script others.
    """
    if not violated.source:
        raise CxbridgeError("a function of Python has no text that a test could have")
    lines = ['"""A counterexample that `cxbridge explore` has found: the agent lacks a property."""', "", ""]
    script = list(_script(played))
    if played.on_board and any(".does(usual" in line for line in script):
        lines += [
            "def usual(call):",
            "    return None  # it ends as it does when nobody says anything",
            "",
            "",
        ]
    given = "".join(f", {key}={value!r}" for key, value in _given(options))
    lines += [
        f"def test_{identifier(violated.name)}(cx):",
        f'    """{_docstring(words)}"""',
        f"    run = cx.run({_plain(options.scenario)!r}{given})",
        *(f"    {line}" for line in script),
        f"    run.assert_properties({violated.source!r}, timeout={options.timeout:g})",
        "",
    ]
    return "\n".join(lines)


def _script(played: Played) -> Iterator[str]:
    """Yield the lines that say how skills end."""
    counts: dict[str, list[tuple[str, Any]]] = {}
    calls: dict[str, str] = {}
    for choice in played.choices:
        skill = skill_of(choice)
        if skill is None:
            if choice.option != USUAL:
                raise CxbridgeError(f"a test cannot script {choice.point.subject}")
            continue
        who, called, args = skill
        if "/" in who:
            raise CxbridgeError("a test runs one agent, and not several")
        calls[f"{called}{{{args}}}"] = f"run.skills({', '.join((repr(called), *_keywords(args)))})"
        outcomes = counts.setdefault(f"{called}{{{args}}}", [])
        outcomes.append((choice.taken.name if choice.option != USUAL else "", choice.taken.value))
    for key, outcomes in counts.items():
        last = max((place for place, each in enumerate(outcomes) if each[0]), default=-1)
        if last >= 0:
            yield calls[key] + "".join(_behaviours(outcomes[: last + 1], on_board=played.on_board))


def _behaviours(outcomes: list[tuple[str, Any]], *, on_board: bool) -> Iterator[str]:
    while outcomes:
        first = outcomes[0]
        times = next((place for place, each in enumerate(outcomes) if each != first), len(outcomes))
        del outcomes[:times]
        name, value = first
        if not name:
            yield f".does(usual, times={times})" if on_board else f".succeeds(times={times})"
            continue
        if not isinstance(value, Outcome):
            raise CxbridgeError(f"a test cannot script that a skill {name}")
        more = [repr(value.error)] if value.error else []
        more += [f"after={value.seconds!r}"] if value.seconds != 1.0 else []
        verb = "fails" if value.status is Status.S_FAILED else "succeeds"
        yield f".{verb}({', '.join((*more, f'times={times}'))})"


def _keywords(args: str) -> Iterator[str]:
    """Yield the arguments of a call that have a name, as Python has them."""
    try:
        call = ast.parse(f"call({args})", mode="eval").body
    except SyntaxError:
        return
    if isinstance(call, ast.Call):
        yield from (ast.unparse(each) for each in call.keywords)


def _given(options: RunOptions) -> Iterator[tuple[str, Any]]:
    for key in _OPTIONS:
        value = _plain(getattr(options, key))
        if value:
            yield key, value


def _plain(value: object) -> object:
    if isinstance(value, Path):
        return str(value.resolve())
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    return value


def identifier(name: str) -> str:
    """Return a name as functions and files can have it."""
    return _NO_NAME.sub("_", name).strip("_").lower()[:60].strip("_") or "property"


def _docstring(words: str) -> str:
    text = " ".join(words.replace("\\", "\\\\").replace('"""', "'''").split())
    return f"{text} " if text.endswith('"') else text
