"""A slot that is added only to the deftemplate in `goal.clp` appears in all views of goals."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from cxbridge.clipstext.goal_slots import DECLARATION_FILE, GOAL_SLOTS, read_slots
from cxbridge.history.outcome import outcomes_as_json
from tests.history.test_lives import AGENT, SCENARIO
from tests.support import PACKAGES, ROOT, needs_plugin

NODE = shutil.which("node")

ADDED = "  (slot deadline    ; seconds\n    (type INTEGER) (default 0))\n  (multislot warning)"
REST = """
import json
from cxbridge.run.program.additions import NO_ADDITIONS
from cxbridge_web.fawkes.executive import Goal, _make_goal
from cxbridge_web.models import make_schemas, to_json
from cxbridge.executive.host.values import Symbol
values = {"id": Symbol("g"), "priority": 0.0, "message": "", "deadline": 7}
for name in ("type", "sub-type", "class", "mode", "outcome", "parent"):
    values[name] = Symbol("x")
for name in ("error", "params", "meta", "required-resources", "acquired-resources"):
    values[name] = ()
schema = make_schemas([Goal], [])["Goal"]["properties"]["deadline"]["type"]
print(json.dumps([json.loads(to_json(_make_goal({}, values)))["deadline"], schema]))
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the package with an additional slot of goals."""
    folder = tmp_path_factory.mktemp("package")
    ignored = shutil.ignore_patterns("__pycache__")
    for source in PACKAGES:
        shutil.copytree(source, folder / source.name, ignore=ignored)
    for name in ("interfaces", "luaskills"):
        (folder / name).symlink_to(ROOT / name)
    goal = folder / "cxbridge" / DECLARATION_FILE.relative_to(PACKAGES[0])
    text = goal.read_text()
    assert text.count("  (multislot warning)") == 1
    goal.write_text(text.replace("  (multislot warning)", ADDED))
    return folder


def run(package: Path, *arguments: str) -> str:
    process = subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "PYTHONPATH": str(package)},
        cwd=package,
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode in (0, 1), process.stderr
    return process.stdout


@pytest.fixture(scope="module")
def events(package: Path) -> list[dict[str, Any]]:
    """Return the events of a run whose rules set the slot."""
    agent = package / "agent"
    agent.mkdir()
    (agent / "scenario.yaml").write_text(SCENARIO)
    (agent / "twice.clp").write_text(AGENT.replace("(params round ?n)", "(deadline (* 10 ?n))"))
    trace = str(package / "run.mcap")
    run(package, "-m", "cxbridge", "run", str(agent), "--trace", trace, "--trace-level", "facts")
    lines = run(package, "-m", "cxbridge", "trace", "cat", trace, "--json").splitlines()
    return [event for event in map(json.loads, lines) if event["kind"] in ("goal", "fact")]


def test_declaration_with_slot_is_read():
    assert {slot.name for slot in GOAL_SLOTS} >= {"id", "class", "mode", "params", "is-executable"}
    more = read_slots(DECLARATION_FILE.read_text().replace("  (multislot warning)", ADDED))
    (deadline,) = set(more) - set(GOAL_SLOTS)
    assert deadline == ("deadline", False, "INTEGER", "0")


def test_facts_and_events_have_slot(events: list[dict[str, Any]]):
    facts = [event["text"] for event in events if event["kind"] == "fact" and event["template"] == "goal"]
    assert any("(deadline 20)" in text for text in facts)
    deadlines = {
        (event["goal"], event["slots"].get("deadline")) for event in events if event["kind"] == "goal"
    }
    assert deadlines == {("HOUSE", None), ("ROOM", "10"), ("ROOM", "20")}


@pytest.mark.usefixtures("events")
def test_text_lines_have_slot(package: Path):
    code = (
        "import sys; from pathlib import Path; from cxbridge.trace.formats.registry import open_run;"
        "from cxbridge.trace.formats.transitions_text import TransitionsWriter as W;"
        "w = W('golden.txt', details=True); [w.write(e) for e in open_run('run.mcap')]; w.close();"
        "print([e.slots.get('deadline') for e in open_run('golden.txt') if e.KIND.name == 'goal'])"
    )
    output = run(package, "-c", code)
    assert "'10'" in output
    assert "'20'" in output
    assert "  deadline=20" in (package / "golden.txt").read_text()


@needs_plugin("web")
def test_rest_has_slot(package: Path):
    assert json.loads(run(package, "-c", REST)) == [7, "integer"]


@needs_plugin("web")
@pytest.mark.skipif(NODE is None, reason="needs node")
def test_page_has_slot(package: Path, events: list[dict[str, Any]]):
    static = package / "cxbridge_web" / "static"
    (static / "package.json").write_text('{"type": "module"}')
    (static / "node_modules").mkdir()
    (static / "node_modules" / "cx").symlink_to(static / "js")
    assert NODE is not None
    script = ROOT / "plugins/cxbridge-web/tests/web_tests" / "page" / "model_of_run.mjs"
    process = subprocess.run(
        [NODE, str(script), str(static / "js"), json.dumps(outcomes_as_json())],
        input="\n".join(map(json.dumps, events)),
        capture_output=True,
        text=True,
        check=True,
    )
    now = {goal["key"]: goal["slots"].get("deadline") for goal in json.loads(process.stdout)["now"]}
    assert now["ROOM"] == "10"
    assert now["ROOM#2"] == "20"
