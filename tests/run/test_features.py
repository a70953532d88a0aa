"""A feature of this package is a module in a folder: nothing else has to know of it."""

from __future__ import annotations

import sys

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine
from cxbridge.run import RunOptions, features, run_scenario
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
