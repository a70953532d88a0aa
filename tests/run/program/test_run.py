"""Runs that a Python program makes, from ``import cxbridge as cx`` alone."""

from __future__ import annotations

import json
import subprocess
import sys
from base64 import b64decode
from pathlib import Path

import pytest

import cxbridge as cx
from tests.support import ROOT, needs_plugin

SCENARIO = ROOT / "scenarios" / "test-scenario"


class Greeter(cx.Feature):
    name = "greeter"

    def __init__(self) -> None:
        self.greeted: list[str] = []

    def init_context(self, env: cx.ClipsEnvironment) -> None:
        env.define("greet", self.greeted.append, 1, types="*;sy")


def say(text, wait=False):
    return f"said {text}"


@pytest.fixture(scope="module")
def run() -> cx.Run:
    return cx.run("test-scenario")


def test_run_has_status_reason_and_duration(run):
    assert (run.status, run.reason) == (0, "every root goal ended COMPLETED")
    assert run.seconds > 1


def test_run_equals_its_recording(run, tmp_path):
    recorded = cx.run(SCENARIO, trace=tmp_path / "run.mcap")
    opened = cx.open_run(tmp_path / "run.mcap")
    for other in (recorded, opened):
        assert [goal.id for goal in other.goals] == [goal.id for goal in run.goals]
        assert [action.text for action in other.actions] == [action.text for action in run.actions]
        assert [call.skill_string for call in other.skills] == [call.skill_string for call in run.skills]
        assert run.compare(other, order="total").same
    assert (opened.status, opened.reason) == (run.status, run.reason)
    assert run.compare(str(tmp_path / "run.mcap")).same
    with pytest.raises(cx.CxbridgeError, match="nowhere"):
        run.compare("nowhere")


def test_goal_is_found_by_id_and_class(run):
    parent = run.goal("TESTGOAL-PARENT")
    assert (parent.outcome, run.goal(parent.id)) == ("COMPLETED", parent)
    with pytest.raises(cx.CxbridgeError, match="no goals match 'PARENT'") as error:
        run.goal("PARENT")
    assert "TESTGOAL-PARENT" in str(error.value.hint)


def test_text_of_run_has_goals_and_result(run):
    lines = str(run).splitlines()
    assert "TESTGOAL-PARENT" in str(run)
    assert lines[-1] == "test-scenario: every root goal ended COMPLETED"
    assert repr(run) == f"<Run test-scenario: status 0, {len(run.goals)} goals>"


def test_run_has_log(run):
    levels = {line.level.value for line in run.log("W")}
    assert levels
    assert levels <= {"W", "E"}
    assert len(run.log("D")) > len(run.log()) > len(run.log("W"))


@needs_plugin("web")
def test_run_is_page_in_notebook_and_file(run, tmp_path):
    page = run.write_report(tmp_path / "run.html").read_text()
    assert f"<title>{run.source.path.name}</title>" in page
    html = run._repr_html_()
    assert html.startswith('<iframe src="data:text/html;base64,')
    assert b64decode(html.split(",", 1)[1].split('"', 1)[0]).decode() == page


def test_feature_exists_before_agent_loads(tmp_path):
    agent = tmp_path / "agent"
    agent.mkdir()
    (agent / "agent.clp").write_text('(defrule greet (executive-init) => (greet "you"))\n')
    (agent / "scenario.yaml").write_text(
        "clips-executive: {spec: s, specs: {s: {init: {stage-3: [{name: agent, file: agent.clp}]}}}}\n"
    )
    greeter = Greeter()
    cx.run(agent, features=[greeter], clips_dirs=agent, timeout=2)
    assert greeter.greeted == ["you"]


def test_functions_are_skills(run):
    mine = cx.run("test-scenario", skills=[say])
    assert mine.status == 0, mine.reason
    assert [call.skill_string for call in mine.skills] == [call.skill_string for call in run.skills]
    assert run.compare(mine).same


def test_failed_skill_fails_goal():
    def broken(*, text, wait=False):
        raise cx.SkillFailedError("no voice today")

    run = cx.run("test-scenario", skills={"say": broken})
    assert run.status == 1
    assert {call.error for call in run.skills} == {"no voice today"}


def test_unknown_argument_fails_skill():
    def say(words):
        pass

    run = cx.run("test-scenario", skills=[say])
    assert run.status == 1
    assert "say(words): " in run.skills[0].error
    assert "given: text, wait" in run.skills[0].error


def test_classes_are_skills_of_skill_board():
    begun = []

    class Move(cx.Skill):
        skills = ("move", "goto")

        def execute(self, call):
            begun.append((call.agent, call.skill))
            yield 0.5

    run = cx.run("two-robots", skills=[Move])
    assert run.status == 0, run.reason
    assert {agent for agent, _ in begun} == {"robot1", "robot2"}


def test_configured_executor_is_replaced_as_a_whole():
    with pytest.raises(cx.CxbridgeError, match="robot1-move executes move, goto"):
        cx.run("two-robots", skills={"move": lambda: None})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"speeech": "on"}, "a run has no option 'speeech'"),
        ({"skiller": "lau"}, "--skiller cannot be 'lau'"),
        ({"skills": [3]}, "3 is not a skill"),
        ({"skills": [lambda text: None]}, "this function has no name"),
        ({"config": "nowhere.yaml"}, "nowhere.yaml"),
        ({"config": {"a/b": 1}}, "'config' must be a path or a list of paths, not {'a/b': 1}"),
        ({"config": [{"a/b": 1}]}, "write the values into a YAML file"),
        ({"clips_dirs": 3}, "'clips_dirs' must be a path or a list of paths, not 3"),
    ],
)
def test_invalid_options_are_one_error(options, message):
    with pytest.raises(cx.CxbridgeError) as error:
        cx.run("test-scenario", **options)
    assert message in str(error.value)


def test_import_of_package_is_lazy():
    program = "import sys, cxbridge as cx; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", f"import json; {program}"],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert [name for name in json.loads(done.stdout) if name.startswith("cxbridge")] == ["cxbridge"]


def test_stub_has_all_names():
    import ast

    stub = ast.parse((Path(cx.__file__).parent / "__init__.pyi").read_text())
    typed = {
        alias.asname or "" for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names
    } - {""}
    assert typed == {"run", *vars(cx)["_MODULE_BY_NAME"]}
    assert cx.Skill is cx.SkillExecutor
    for name in typed:
        assert getattr(cx, name) is not None
    assert cx.BatteryInterface.__name__ == "BatteryInterface"
    assert {"run", "connect", "open_run", "BatteryInterface"} <= set(dir(cx))
    with pytest.raises(AttributeError, match="no attribute 'rum'"):
        getattr(cx, "rum")  # noqa: B009 - to mypy, too, there is none
