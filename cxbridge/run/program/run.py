"""The function behind ``cxbridge.run("test-scenario")``, for programs and notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.run.program.additions import Additions
from cxbridge.run.program.finished import Run
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge.run.program.skills import Skills, make_executor_classes
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
    """Run a scenario headless, to its end.

    For example::

        run = cx.run("test-scenario")
        assert run.status == 0, run.reason
        print(run)

    :param scenario: a shipped scenario's name, a folder with a ``scenario.yaml``, or a Fawkes configuration.
    :param features: features of the executive's environment, present before its first file.
    :param skills: Python skills: subclasses of ``cx.Skill``, or functions. They replace the Lua skills, or
        the skill board's executors, of the same names.
    :param config: overlays of the scenario's configuration; later files win.
    :param trace: an mcap file for the recording.
    :param trace_level: the detail of the recording: ``transitions``, ``rules`` or ``facts``.
    :param timeout: seconds of the run's clock.
    :param options: further options of ``cxbridge run``, e.g. ``clock="real"``, ``skiller="simulator"``.
    :raises CxbridgeError: if the scenario, an option or a skill is wrong. A failed goal raises nothing.
    """
    run_options = options_from_keywords(
        scenario, config=config, trace=trace, trace_level=trace_level, timeout=timeout, **options
    )
    recording = MemoryRun(Path(scenario).name if scenario is not None else "run")
    additions = Additions(tuple(features), make_executor_classes(skills), (recording.writer(),))
    run_scenario(run_options, additions=additions)
    return Run(recording)
