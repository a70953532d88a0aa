"""Runs a scenario for a Python program."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import Additions
from cxbridge.run.program.finished import Run
from cxbridge.run.program.skills import Skills, executor_classes
from cxbridge.run.run import run_scenario
from cxbridge.trace.memory import MemoryRun

if TYPE_CHECKING:
    from cxbridge.executive.feature import Feature

_PATHS = ("clips_dirs", "interface_dirs", "skill_dirs", "replay")
"""Options that are several paths."""


def run(
    scenario: str | Path | None = None,
    *,
    features: Sequence[Feature] = (),
    skills: Skills = (),
    config: str | Path | Sequence[str | Path] = (),
    trace: str | Path | None = None,
    trace_level: str = "transitions",
    timeout: float = 600.0,
    **options: Any,
) -> Run:
    """Run a scenario to its end, headless.

    For example::

        run = cx.run("test-scenario")
        assert run.status == 0, run.reason
        print(run)

    :param scenario: the name of a shipped one, a folder with a ``scenario.yaml``, or a Fawkes configuration.
    :param features: features of yours; the executive's environment has them before it loads its first file.
    :param skills: skills in Python, subclasses of ``cx.Skill`` or functions; they replace the Lua
        skills, or of the skill board's executors of these skills.
    :param config: configuration files on top of the scenario's, each over those before it.
    :param trace: record the run to this mcap file, too.
    :param trace_level: ``transitions``, ``rules`` or ``facts``: how much is kept of the run.
    :param timeout: seconds of the run's clock until it is given up.
    :param options: the other options of ``cxbridge run``, e.g. ``clock="real"``, ``skiller="simulator"``.
    :raises CxbridgeError: when the scenario, an option or a skill is wrong; a failed goal is not an error.
    """
    run_options = make_options(
        scenario, config=config, trace=trace, trace_level=trace_level, timeout=timeout, **options
    )
    name = Path(scenario).name if scenario is not None else "run"
    kept = MemoryRun(name)
    additions = Additions(tuple(features), executor_classes(skills), (kept.writer(),))
    run_scenario(run_options, additions=additions)
    return Run(kept)


def more_options(given: dict[str, Any], find: Callable[[str | Path], Path] = Path) -> Iterator[Any]:
    """Yield a group for each plug-in whose options are given, and remove these options.

    :param given: options by name; a text may stand for a path.
    :param find: returns the path for a text.
    """
    for group in RunOptions.added_groups():
        hints = get_type_hints(group)
        own = {name: given.pop(name) for name in hints if name in given}
        if own:
            paths = {name for name in own if Path in get_args(hints[name])}
            yield group(
                **{name: find(value) if name in paths and value else value for name, value in own.items()}
            )


def make_options(scenario: str | Path | None, **given: Any) -> RunOptions:
    """Return the options of a run; paths may be texts, and one may stand for several.

    :raises CxbridgeError: when there is no such option.
    """
    values: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    values["more"] = tuple(more_options(values))
    known = RunOptions.__dataclass_fields__
    unknown = [name for name in values if name not in known]
    if unknown:
        raise CxbridgeError(f"a run has no option '{unknown[0]}'", hint=f"it has: {', '.join(sorted(known))}")
    for name in ("config", *_PATHS):
        if name in values:
            each = values[name]
            several = [each] if isinstance(each, str | Path) else each
            values[name] = tuple(map(Path, several))
    for name in ("trace", "log", "bblog", "fawkes_dir"):
        if name in values:
            values[name] = Path(values[name])
    return RunOptions(scenario=None if scenario is None else Path(scenario), **values)
