"""Writes a pytest test that scripts the choices of a run, and fails while the agent violates a property."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions
from cxbridge.skiller.simulation.deciders import FOREVER_S, Outcome
from cxbridge.skiller.status import Status
from cxbridge_explore.counterexample_playing import PlayedRun
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.worlds.points import USUAL, ChoiceKind

# The options of a run that the fixture `cx` takes, too.
_FIXTURE_OPTIONS: Final = (
    "spec",
    "agent",
    "core",
    "fawkes_dir",
    "overlays",
    "clips_dirs",
    "interface_dirs",
    "skill_dirs",
    "config",
)
# The kinds of choices that decide about a skill, whose results the fixture can script.
_SCRIPTABLE_KINDS: Final = frozenset({ChoiceKind.SKILL, ChoiceKind.DURATION})
_DEFAULT_DURATION_S: Final = 1.0  # of a scripted skill without a duration

_MAX_IDENTIFIER_LENGTH: Final = 60  # chosen freely, for readable names of files
_NON_WORD_CHARACTERS: Final = re.compile(r"\W+")


def make_test_text(
    options: RunOptions, run: PlayedRun, violated_property: Property, description: str, folder: Path
) -> str:
    """Return the text of a test file.

    :param description: the docstring of the test.
    :param folder: the folder of the file, to which the paths in the test are relative.
    :raises CxbridgeError: if the run has several agents, or the fixture cannot script a choice.
    """
    script = list(_make_script_lines(run))
    needs_usual = any(".does(usual" in line for line in script)
    usual_function = (
        ["def usual(call):", "    return None  # the usual result", "", ""] if needs_usual else []
    )
    option_arguments = "".join(f", {key}={value!r}" for key, value in _list_option_arguments(options, folder))
    lines = [
        '"""A counterexample that `cxbridge explore` has found: the agent violates a property."""',
        "",
        "",
        *usual_function,
        f"def test_{make_identifier(violated_property.name)}(cx):",
        f'    """{_escape_docstring(description)}"""',
        f"    run = cx.run({_to_literal(options.scenario, folder)!r}{option_arguments})",
        *(f"    {line}" for line in script),
        f"    run.assert_properties({violated_property.source!r}, timeout={options.timeout:g})",
        "",
    ]
    return "\n".join(lines)


def _make_script_lines(run: PlayedRun) -> Iterator[str]:
    """Yield the lines that script the results of skills.

    :raises CxbridgeError: if the run has several agents, or the fixture cannot script a choice.
    """
    if run.agent_count > 1:
        raise CxbridgeError("a test runs only one agent")
    for choice in run.choices:
        if choice.option_index != USUAL and choice.point.kind not in _SCRIPTABLE_KINDS:
            raise CxbridgeError(f"a test cannot script {choice.point.subject}")
    outcomes_by_selection: dict[str, list[Outcome | None]] = {}
    for call, outcome in run.skill_results:
        # the fixture selects calls by named arguments only
        arguments = [f"{key}={value!r}" for key, value in call.args.items() if isinstance(key, str)]
        outcomes_by_selection.setdefault(
            f"run.skills({', '.join((repr(call.name), *arguments))})", []
        ).append(outcome)
    for selection, outcomes in outcomes_by_selection.items():
        while outcomes and outcomes[-1] is None:  # after its last entry, a script gives the usual outcome
            outcomes.pop()
        if outcomes:
            yield selection + "".join(_make_outcome_calls(outcomes, uses_skill_board=run.uses_skill_board))


def _make_outcome_calls(outcomes: Sequence[Outcome | None], *, uses_skill_board: bool) -> Iterator[str]:
    """Yield the calls that script the outcomes of a skill; None stands for the usual outcome."""
    for outcome, equal_outcomes in groupby(outcomes):
        times = f"times={len(list(equal_outcomes))}"
        seconds = _DEFAULT_DURATION_S if outcome is None or outcome.seconds is None else outcome.seconds
        if outcome is None:  # the usual outcome of an executor of a skill board may be a failure
            yield f".does(usual, {times})" if uses_skill_board else f".succeeds({times})"
        elif seconds >= FOREVER_S:
            yield f".hangs({times})"
        else:
            arguments = [repr(outcome.error)] if outcome.error else []
            arguments += [f"after={seconds!r}"] if seconds != _DEFAULT_DURATION_S else []
            verb = "fails" if outcome.status is Status.S_FAILED else "succeeds"
            yield f".{verb}({', '.join((*arguments, times))})"


def _list_option_arguments(options: RunOptions, folder: Path) -> Iterator[tuple[str, Any]]:
    """Yield the names and values of the options that the test passes to the fixture."""
    for key in _FIXTURE_OPTIONS:
        value = _to_literal(getattr(options, key), folder)
        if value:
            yield key, value
    for group in options.plugin_groups:
        yield from ((key, _to_literal(value, folder)) for key, value in vars(group).items() if value)


def _to_literal(value: object, folder: Path) -> object:
    """Return the value of an option as a value whose repr is a literal.

    The paths of existing files and folders become relative to a folder.
    """
    if isinstance(value, Path):
        if not value.exists():
            return str(value)  # the name of a shipped scenario
        try:
            return Path(os.path.relpath(value.resolve(), folder.resolve())).as_posix()
        except ValueError:  # on Windows, the folder is on another drive
            return str(value.resolve())
    if isinstance(value, tuple):
        return tuple(_to_literal(item, folder) for item in value)
    return value


def make_identifier(name: str) -> str:
    """Return the name of a property in lower-case letters, digits and underscores.

    The result is a part of the names of files and functions; ``property`` for a name with none of these.
    """
    # cut, since a property without a name has its whole form as the name
    return (
        _NON_WORD_CHARACTERS.sub("_", name).strip("_").lower()[:_MAX_IDENTIFIER_LENGTH].strip("_")
        or "property"
    )


def _escape_docstring(sentence: str) -> str:
    """Return a sentence escaped for a docstring."""
    text = " ".join(sentence.replace("\\", "\\\\").replace('"""', "'''").split())
    return f"{text} " if text.endswith('"') else text  # a quote at the end would end the docstring too early
