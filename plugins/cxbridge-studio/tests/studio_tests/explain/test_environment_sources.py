"""An environment is built again from what was recorded."""

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
from cxbridge_studio.environment_sources import find_building_steps
from tests.support import ROOT


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The test scenario, recorded with its rules."""
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    run_scenario(RunOptions(scenario=ROOT / "scenarios" / "test-scenario", trace=path, trace_level="rules"))
    return open_run(path)


def build_again(run: Run, folder: Path) -> ClipsEnvironment:
    """Build the executive's environment from nothing but a recording."""
    env = ClipsEnvironment("again", EventBus(VirtualClock()))
    for source in find_building_steps(run, "executive"):
        data, details = source.data, source.details
        if source.role == "function":
            most = int(details["maximum"])
            env.define(source.name, lambda *_: None, int(details["minimum"]), most, details["types"])
        elif source.role == "construct":
            assert data is not None
            env.build(data.decode())
        elif source.role == "clips":
            assert data is not None
            path = folder / source.name.rsplit("/", 1)[-1]
            path.write_bytes(data)
            env.load(path) if details["how"] == "load" else env.batch(path)
    return env


def test_an_environment_can_be_built_again(recorded: Run, tmp_path: Path) -> None:
    env = build_again(recorded, tmp_path)
    rules = env.eval("(get-defrule-list *)")
    assert isinstance(rules, tuple)
    fired = {event.rule for event in recorded if isinstance(event, RuleFired)}
    assert len(fired) > 90
    assert fired <= {str(rule).removeprefix("MAIN::") for rule in rules}
    assert env.loader.diagnostics == []
    settings = [dict(source.details) for source in run_sources(recorded, "settings")]
    assert settings == [{"strategy": "depth", "salience": "when-defined", "duplicates": "FALSE"}] * 2
    env.destroy()


def test_what_a_file_has_loaded_comes_before_it(tmp_path: Path) -> None:
    def told(name: str, within: str = "") -> SourceRead:
        return SourceRead(1, "clips", "e", name, name.encode(), {"within": within})

    with McapWriter(tmp_path / "run.mcap") as writer:
        for event in (told("a"), told("b"), told("c", "b"), told("d", "c"), told("e", "b"), told("f")):
            writer.write(event)
    steps = find_building_steps(open_run(tmp_path / "run.mcap"), "e")
    assert [source.name for source in steps] == ["a", "d", "c", "e", "b", "f"]


def test_the_steps_of_a_time_are_those_of_the_last_environment_by_then(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "run.mcap") as writer:
        for time_us, role in enumerate(["environment", "clips", "environment", "clips"]):
            writer.write(SourceRead(time_us, role, "e", f"{role}-{time_us}", None, {}))
    run = open_run(tmp_path / "run.mcap")
    steps = [[source.name for source in find_building_steps(run, "e", until)] for until in (None, 2, 1)]
    assert steps == [["clips-3"], [], ["clips-1"]]
