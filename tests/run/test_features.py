"""A feature of this package is a module in a folder: nothing else has to know of it."""

from __future__ import annotations

import sys

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine
from cxbridge.executive.feature import LazyFeature
from cxbridge.run import RunOptions, features, run_scenario
from cxbridge.run.agent_context import make_agent_context
from cxbridge.run.context import RunContext
from tests.run.mini import AGENT, write_scenario

GREET = """
from cxbridge.executive.feature import Feature


class Greet(Feature):
    name = "greet-people"

    def init_context(self, env):
        env.define("greet", greet, 1)


def greet(name: str) -> str:
    return f"Good morning, {name}."


def make(context):
    return Greet()
"""
RULE = '(defrule greeting (executive-initialized) => (printout t (greet "Robin") crlf))'


@pytest.fixture
def greet(tmp_path, monkeypatch):
    """A folder with one feature in one file, as if it were one of ours; it is gone afterwards."""
    folder = tmp_path / "features"
    folder.mkdir()
    (folder / "greet_people.py").write_text(GREET)
    monkeypatch.setattr(features, "__path__", [*features.__path__, str(folder)])
    yield
    sys.modules.pop("cxbridge.run.features.greet_people", None)


def said(folder) -> list[str]:
    """What a run of the scenario logs, whatever becomes of it."""
    events: list[Event] = []
    run_scenario(RunOptions(scenario=folder), events.append)
    return [event.text for event in events if isinstance(event, LogLine)]


def test_a_feature_is_one_file(greet, tmp_path):
    folder = write_scenario(tmp_path, agent=AGENT + RULE, feature="greet-people")
    lines = said(folder)
    assert "Good morning, Robin." in lines


def test_a_feature_without_its_file_is_gone(tmp_path):
    folder = write_scenario(tmp_path, agent=AGENT, feature="greet-people")
    with pytest.raises(CxbridgeError, match="greet-people"):
        said(folder)


@pytest.mark.parametrize(
    ("name", "configured", "made"),
    [
        ("SECTION", True, True),
        ("SECTION", False, False),
        ("NEEDED_SECTION", True, False),
        ("NEEDED_SECTION", False, None),
    ],
)
def test_a_feature_names_its_part_of_the_configuration(greet, tmp_path, name, configured, made):
    (tmp_path / "features" / "greet_people.py").write_text(f"{GREET}\n{name} = '/greetings'\n")
    folder = write_scenario(tmp_path / "scenario")
    if configured:
        scenario = folder / "scenario.yaml"
        scenario.write_text(f"{scenario.read_text()}\ngreetings: {{language: en}}\n")
    context = RunContext.make(make_agent_context(RunOptions(scenario=folder)), RunOptions(scenario=folder))
    found = {feature.name: feature for feature in features.package_features(context)}
    context.close()
    greeting = found.get("greet-people")
    assert (None if greeting is None else not isinstance(greeting, LazyFeature)) is made
