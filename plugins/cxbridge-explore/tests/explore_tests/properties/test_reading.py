"""Reading of properties, and runs with and without watched properties."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from cxbridge.errors import ConfigError
from cxbridge.events import Event, FactChange, GoalTransition, PlanActionTransition, RuleFired, SkillStatus
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.properties.forms import read_property
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.properties.reading import combine_properties, read_properties, read_scenario_properties
from explore_tests.properties.runs import BUILTIN, shipped_options, watch_run


def test_file_has_named_properties(tmp_path: Path):
    file = tmp_path / "properties.yaml"
    file.write_text("- never (goal (outcome FAILED))\n- calm: eventually (goal) within 3\n")
    assert [each.name for each in read_properties(file)] == ["never (goal (outcome FAILED))", "calm"]
    assert [each.name for each in read_scenario_properties(tmp_path)] == [
        "never (goal (outcome FAILED))",
        "calm",
    ]
    assert read_scenario_properties(tmp_path / "missing" / "scenario.yaml") == []


@pytest.mark.parametrize("text", ["{a: b}", "- [never]", "- nevr (goal)", "- a: {b: c}", "- never (goal"])
def test_invalid_file_is_error_with_line(text: str, tmp_path: Path):
    file = tmp_path / "properties.yaml"
    file.write_text(f"# one line\n{text}\n")
    with pytest.raises(ConfigError) as error:
        read_properties(file)
    assert error.value.location.startswith(f"{file}:2")


def test_error_of_property_in_run_has_line(tmp_path: Path):
    file = tmp_path / "properties.yaml"
    file.write_text("# one line\n- never (gaol)\n")
    with pytest.raises(ConfigError, match="did you mean goal") as error:
        watch_run(shipped_options("test-scenario"), read_properties(file))
    assert error.value.location.startswith(f"{file}:2")


def test_duplicate_name_is_error():
    with pytest.raises(ConfigError, match="two properties 'run-ends'"):
        combine_properties(BUILTIN, [read_property("run-ends: never (goal)")])


PATTERNS = tuple(
    read_property(text)
    for text in (
        "never (goal (class NONE))",
        "never (goal (class ?c)) (not (plan)) (test (eq ?c NONE))",
        "always (domain-operator)",
        "eventually (goal (class TALK) (mode FINISHED)) within 100",
        "after (goal (id ?g) (mode SELECTED)) then (goal (id ?g) (mode RETRACTED))",
    )
)


@pytest.mark.parametrize("scenario", ["test-scenario", "two-robots"])
def test_watched_run_equals_unwatched_run(scenario: str):
    """Properties of rules and facts also keep the numbers of rules and facts equal."""

    def play_events(properties: Sequence[Property]) -> list[Event]:
        events: list[Event] = []

        def before(run: ExploredRun) -> None:
            types = (GoalTransition, PlanActionTransition, SkillStatus, RuleFired, FactChange)
            run.assembly.bus.subscribe(events.append, *types)

        watch_run(shipped_options(scenario), properties, before=before)
        return events

    unwatched = play_events([])
    assert any(isinstance(event, RuleFired | SkillStatus) for event in unwatched)
    assert play_events([*BUILTIN, *PATTERNS]) == unwatched
