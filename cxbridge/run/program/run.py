"""Runs a scenario for a Python program."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.run.program.additions import Additions
from cxbridge.run.program.finished import Run
from cxbridge.run.program.plain_options import make_options
from cxbridge.run.program.skills import Skills, executor_classes
from cxbridge.run.run import run_scenario
from cxbridge.trace.memory import MemoryRun

if TYPE_CHECKING:
    from cxbridge.executive.feature import Feature


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
