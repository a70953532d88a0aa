"""Environments from recorded sources."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus, RuleFired, SourceRead
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.sources import run_sources
from cxbridge_studio.environment_sources import find_build_sources
from tests.support import ROOT


@pytest.fixture(scope="module")
def recorded_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The recorded test scenario, with the sources of its rules."""
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    run_scenario(RunOptions(scenario=ROOT / "scenarios" / "test-scenario", trace=path, trace_level="rules"))
    return open_run(path)


def rebuild_environment(run: Run, folder: Path) -> ClipsEnvironment:
    """Return the environment of the executive, from the recording only."""
    env = ClipsEnvironment("again", EventBus(VirtualClock()))
    for source in find_build_sources(run, "executive"):
        data, details = source.data, source.details
        if source.role == "function":
            maximum = int(details["maximum"])
            env.define(source.name, lambda *_: None, int(details["minimum"]), maximum, details["types"])
        elif source.role == "construct":
            assert data is not None
            env.build(data.decode())
        elif source.role == "clips":
            assert data is not None
            path = folder / source.name.rsplit("/", 1)[-1]
            path.write_bytes(data)
            env.load(path) if details["how"] == "load" else env.batch(path)
    return env


def test_environment_is_rebuilt_from_recording(recorded_run: Run, tmp_path: Path) -> None:
    env = rebuild_environment(recorded_run, tmp_path)
    rules = env.eval("(get-defrule-list *)")
    assert isinstance(rules, tuple)
    fired = {event.rule for event in recorded_run if isinstance(event, RuleFired)}
    assert len(fired) > 90
    assert fired <= {str(rule).removeprefix("MAIN::") for rule in rules}
    assert env.loader.diagnostics == []
    settings = [dict(source.details) for source in run_sources(recorded_run, "settings")]
    assert settings == [{"strategy": "depth", "salience": "when-defined", "duplicates": "FALSE"}] * 2
    env.destroy()


def test_loaded_file_comes_before_loading_file(tmp_path: Path) -> None:
    def make_source(name: str, within: str = "") -> SourceRead:
        return SourceRead(1, "clips", "e", name, name.encode(), {"within": within})

    with McapWriter(tmp_path / "run.mcap") as writer:
        for event in (
            make_source("a"),
            make_source("b"),
            make_source("c", "b"),
            make_source("d", "c"),
            make_source("e", "b"),
            make_source("f"),
        ):
            writer.write(event)
    steps = find_build_sources(open_run(tmp_path / "run.mcap"), "e")
    assert [source.name for source in steps] == ["a", "d", "c", "e", "b", "f"]


def test_steps_until_time_belong_to_last_environment(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "run.mcap") as writer:
        for time_us, role in enumerate(["environment", "clips", "environment", "clips"]):
            writer.write(SourceRead(time_us, role, "e", f"{role}-{time_us}", None, {}))
    run = open_run(tmp_path / "run.mcap")
    steps = [[source.name for source in find_build_sources(run, "e", until)] for until in (None, 2, 1)]
    assert steps == [["clips-3"], [], ["clips-1"]]
