"""The views of a run agree on the plan-action of each skill call."""

from __future__ import annotations

import json
import random
import shutil
import subprocess
from collections.abc import Iterator
from itertools import groupby, pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cxbridge_studio", reason="needs cxbridge-studio")
pytest.importorskip("cxbridge_explore", reason="needs cxbridge-explore")

from msgspec.structs import replace

from cxbridge.clipstext.facts import parse_fact
from cxbridge.events import Event, FactChange, InterfaceMessage, PlanActionTransition, SkillStatus
from cxbridge.history.builder import RunHistory
from cxbridge.history.linking import find_skill_links
from cxbridge.history.model import goal_forest
from cxbridge.history.outcome import ENDED_MODES, outcomes_as_json
from cxbridge.resources import shipped_dir
from cxbridge.run.options import RunOptions
from cxbridge.run.run import run_scenario
from cxbridge.trace.codec import encode_with_kind
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.registry import open_run
from cxbridge_explore.counterexample import write_counterexample
from cxbridge_explore.counterexample_playing import play_run
from cxbridge_explore.worlds.points import RandomChooser
from cxbridge_studio.explain.goals import Goals
from cxbridge_studio.explain.recorded import RecordedEvidence
from explore_tests.defects.seeded import DEFECTS, Defect, play_runs
from tests.history import runs as made
from tests.history.runs import ListRun
from tests.history.test_lives import recorded
from tests.support import ROOT, many, share

SHIPPED = sorted(
    folder.name for folder in shipped_dir("scenarios").iterdir() if (folder / "scenario.yaml").exists()
)
DRAWN = [name for name in SHIPPED if name != "temporal"]
"""The scenarios with skills whose results a world draws."""
NODE = shutil.which("node")
NEXT_CALL, NEXT_LIFE, BUSY = 0.2, 0.3, 0.5
"""The probabilities of a new message number, a new goal on FORMULATED, and a busy executor."""
__all__ = ["recorded"]
"""A fixture, which pytest finds here."""

PAGE = ROOT / "plugins/cxbridge-web/cxbridge_web" / "static" / "js"

Action = tuple[str, str, str, str]
"""Environment, goal, plan and id of a plan-action."""

Pair = tuple[Action, str, str]
"""A plan-action, the Skiller and the skill string of a call."""


def called_text(text: str) -> str:
    """Return the skill string, or the skill of an executor's text with progress."""
    return text if "{" in text else text.partition(" ")[0]


def executive_pairs(run: Run) -> set[Pair]:
    """Return the calls in the executive's facts: the sent orders with the skills that ran."""
    sent: dict[tuple[str, str, str], str] = {}
    actions: dict[tuple[str, str, str], Action] = {}
    ran: set[Pair] = set()
    for event in run:
        if isinstance(event, FactChange) and event.asserted and event.template.startswith("skill"):
            slots, env = parse_fact(event.text)[1], event.env
            skiller = slots.get("skiller", "").strip('"')
            action = env, slots.get("goal-id", ""), slots.get("plan-id", ""), slots.get("action-id", "")
            if event.template == "skill":
                sent[env, skiller, slots["id"]] = slots["msgid"]
            elif event.template == "skill-action-execinfo":
                actions[env, skiller, sent[env, skiller, slots["skill-id"]]] = action
            elif event.template == "skill-board-call":
                actions[env, "", slots["id"]] = action
            elif event.template == "skill-board-action" and slots["executor"] != '""':
                action_of_call = actions.get((env, "", slots["id"]))
                if action_of_call is not None:
                    ran.add((action_of_call, slots["executor"].strip('"'), slots["skill"]))
        elif isinstance(event, SkillStatus) and event.status != "S_INACTIVE":
            action_of_call = actions.get((event.env, event.skiller, str(event.msgid)))
            if action_of_call is not None:
                ran.add((action_of_call, event.skiller, event.skill_string))
    return ran


def why_pairs(run: Run) -> Iterator[Pair]:
    """Yield the last skill call of each action in `why`."""
    for env in dict.fromkeys(event.env for event in run if isinstance(event, PlanActionTransition)):
        evidence = RecordedEvidence(run, None, env)
        goals = Goals(evidence.history)
        for goal in goals.records:
            for action in goal.actions:
                if (link := goals.find_skill_link(action)) is not None:
                    assert not link.is_guessed
                    key, call = (env, goal.id, action.plan, action.id), link.call
                    yield key, call.skiller, called_text(call.skill_string)


def linked_pairs(history: RunHistory) -> Iterator[Pair]:
    """Yield each action with its skill call in the history."""
    for link in find_skill_links(history):
        action, call = link.action, link.call
        yield (action.env, action.goal, action.plan, action.id), call.skiller, called_text(call.skill_string)


@pytest.fixture(scope="session")
def page_modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page's modules in a folder that node imports as modules."""
    folder = tmp_path_factory.mktemp("page") / "node_modules" / "cx"
    shutil.copytree(PAGE, folder)
    (folder / "package.json").write_text('{"type": "module"}')
    return folder


def read_page_model(run: Run, modules: Path) -> dict[str, list[Any]]:
    """Return the page's model of a run."""
    assert NODE is not None
    lines = b"".join(encode_with_kind(event) + b"\n" for event in run if event.KIND.name)
    script = ROOT / "plugins/cxbridge-web/tests/web_tests" / "page" / "model_of_run.mjs"
    command = [NODE, str(script), str(modules), json.dumps(outcomes_as_json())]
    process = subprocess.run(command, input=lines, capture_output=True, check=False)
    assert process.returncode == 0, process.stderr.decode()
    model: dict[str, list[Any]] = json.loads(process.stdout)
    return model


def page_pairs(model: dict[str, list[Any]]) -> Iterator[Pair]:
    for call in model["calls"]:
        if call["action"] is not None:
            assert not call["guessed"]
            env, goal, plan, action = call["action"]
            goal = goal.removeprefix(f"{env}:").partition("#")[0]
            yield (env, goal, plan, action), str(call["skiller"]), called_text(str(call["text"]))


def compare_histories(history: RunHistory, model: dict[str, list[Any]]) -> None:
    """Check that the page's model of a run equals the history."""
    states = [
        [[*state, next(changes).time] for state, changes in groupby(goal.changes, itemgetter(2, 3))]
        for goal in history.goals
    ]
    assert [goal["states"] for goal in model["goals"]] == states
    keys = [goal["key"] for goal in model["goals"]]
    parents = [keys.index(goal["parent"]) if goal["parent"] in keys else None for goal in model["goals"]]
    assert parents == list(goal_forest(history.goals).parents.values())
    assert [action[4] for action in model["actions"]] == [action.states for action in history.actions]
    ran = [
        [call.status, call.error, call.begin[1], None if call.end is None else call.end[1]]
        for call in history.calls
    ]
    assert [call["ran"] for call in model["calls"]] == ran


def check_views(run: Run, modules: Path) -> int:
    """Compare all views of a run with the executive's record; return the number of calls."""
    recorded_pairs = executive_pairs(run)
    expected = sorted(recorded_pairs)
    last = {(action, skiller): text for action, skiller, text in recorded_pairs}
    why = {(action, skiller): text for action, skiller, text in why_pairs(run)}
    assert why.keys() <= last.keys()
    assert {action for action, _ in why} == {action for action, _ in last}
    history = RunHistory.from_events(run)
    assert sorted(set(linked_pairs(history))) == expected
    if NODE is not None:
        model = read_page_model(run, modules)
        assert sorted(set(page_pairs(model))) == expected
        compare_histories(history, model)
        texts = [action.text for action in history.actions]
        assert sorted(text for *_, text in model["actions"]) == sorted(texts)
    return len(recorded_pairs)


@pytest.mark.parametrize("name", share(SHIPPED, 3))
def test_views_agree_on_shipped_scenario(name: str, tmp_path: Path, page_modules: Path):
    recorded = tmp_path / "run.mcap"
    scenario = shipped_dir("scenarios") / name
    run_scenario(RunOptions(scenario=scenario, trace=recorded, trace_level="facts", timeout=60.0))
    assert check_views(open_run(recorded), page_modules) > 0


@pytest.mark.parametrize("seed", share(range(100), 3, row=lambda seed: seed % 2))
def test_views_agree_on_drawn_world(seed: int, tmp_path: Path, page_modules: Path):
    """Most runs have two robots with parallel calls."""
    recorded = tmp_path / "run.mcap"
    scenario = "two-robots" if seed % 2 else DRAWN[seed // 2 % len(DRAWN)]
    options = RunOptions(scenario=shipped_dir("scenarios") / scenario, skiller="none", timeout=120.0)
    play_run(options, (), RandomChooser(seed), recorded)
    assert check_views(open_run(recorded), page_modules) > 0


@pytest.mark.parametrize("defect", DEFECTS[: many(len(DEFECTS), 2)], ids=lambda defect: defect.name)
def test_views_agree_on_counterexample(defect: Defect, tmp_path: Path, page_modules: Path):
    options = defect.options(defect.copy(tmp_path / "agent", broken=True))
    path = next(
        path
        for path, played in play_runs(options, defect.properties, defect.faults)
        if defect.found_by in {violation.property for violation in played.violations}
    )
    example = write_counterexample(options, defect.properties, defect.found_by, path, tmp_path / "found")
    assert check_views(open_run(example.recording), page_modules) > 0


def test_links_of_older_recording_are_guessed(tmp_path: Path):
    """Older versions recorded no calls."""
    recorded = tmp_path / "run.mcap"
    run_scenario(RunOptions(scenario=shipped_dir("scenarios") / "two-robots", trace=recorded))
    older: list[Event] = [
        replace(event, skiller="", call="") if isinstance(event, PlanActionTransition) else event
        for event in open_run(recorded)
    ]
    linked, guessed = (
        find_skill_links(RunHistory.from_events(events)) for events in (open_run(recorded), ListRun(older))
    )
    assert {link.is_guessed for link in linked} == {False}
    assert {link.is_guessed for link in guessed} == {True}
    for before, after in pairwise(linked):
        assert before.call.begin <= after.call.begin


def draw_events(draw: random.Random) -> list[Event]:
    """Return transitions in random order, with restarted goals and actions and cut off skills."""
    at, number = 1.0, 0
    events = [made.goal(0, name, "FORMULATED") for name in "ab"]
    for _ in range(draw.randrange(5, 40)):
        at += draw.choice((0, 0, 0.1))
        number += draw.random() < NEXT_CALL
        name, kind = draw.choice("ab"), draw.randrange(3)
        if kind == 0:
            mode = draw.choice(("FORMULATED", "DISPATCHED", "FINISHED", "RETRACTED"))
            ended = mode in ENDED_MODES
            outcome = draw.choice(("COMPLETED", "FAILED")) if ended else "UNKNOWN"
            parents = draw.choice(("nil", "a")) if name == "b" else "nil"
            change = made.goal(at, name, mode, outcome, parent=parents)
            events.append(replace(change, is_new=mode == "FORMULATED" and draw.random() < NEXT_LIFE))
        elif kind == 1:
            state = draw.choice(("FORMULATED", "PENDING", "WAITING", "RUNNING", "FINAL", "FAILED"))
            call = draw.choice(("", str(number)))
            params, skiller = draw.choice(("", "(x)", "(y z)")), "Skiller" if call else ""
            transition = made.action(at, name, draw.randrange(1, 3), "move", state)
            events.append(replace(transition, params=params, skiller=skiller, call=call))
        else:
            status = draw.choice(("S_RUNNING", "S_RUNNING", "S_FINAL", "S_FAILED", "S_INACTIVE"))
            text = "" if status == "S_INACTIVE" else draw.choice(("m{}", "n{}"))
            events.append(replace(made.skill(at, text, status), msgid=number))
    return events


def draw_request(draw: random.Random, master: int) -> list[tuple[str, str, dict[str, Any]]]:
    """Return the messages of a request on a skill board, whose executors may be busy, fail or not answer."""
    arms = ["left", "right"]
    draw.shuffle(arms)
    ticket = {"board": "SkillBoard", "epoch": 1, "master": master}
    board = "SkillBoardInterface::SkillBoard"
    order = {**ticket, "skill": "lift", "parameters": "{}", "agent": "r1", "name": f"lift-{master}"}
    uids = [f"SkillExecutorInterface::{arm}" for arm in arms]
    messages = [(uid, "Request", order) for uid in uids]
    if draw.random() < BUSY:
        messages += [(uids[0], "Confirm", ticket)] if draw.random() < BUSY else []
        messages += [
            (board, "Finish", {**ticket, "executor": arms[0], "outcome": "REFUSED", "error": "busy"})
        ]
        messages += [(uids[1], "Request", order)]
    messages += [
        (uids[1], "Confirm", ticket),
        (board, "Feedback", {**ticket, "executor": arms[1], "progress": 0.5}),
    ]
    outcome = draw.choice(("SUCCEEDED", "FAILED", "CANCELLED", ""))
    end = {**ticket, "executor": arms[1], "outcome": outcome, "error": draw.choice(("", "stuck"))}
    return [*messages, (board, "Finish", end)] if outcome else messages


@pytest.mark.skipif(NODE is None, reason="needs node")
@pytest.mark.parametrize("seed", range(many(300, 10)))
def test_page_reads_skill_board_like_history(seed: int, page_modules: Path):
    draw = random.Random(seed)
    requests = [draw_request(draw, master) for master in range(1, 5)]
    events: list[Event] = []
    while remaining := [request for request in requests if request]:
        uid, kind, values = draw.choice(remaining).pop(0)
        number = len(events)
        events.append(InterfaceMessage(number * 1000, uid, f"{kind}Message", number, "", "queued", values))
    compare_histories(RunHistory.from_events(events), read_page_model(ListRun(events), page_modules))


@pytest.mark.skipif(NODE is None, reason="needs node")
@pytest.mark.parametrize("seed", range(many(300, 10)))
def test_page_reads_random_transitions_like_history(seed: int, page_modules: Path):
    events = draw_events(random.Random(seed))
    compare_histories(RunHistory.from_events(events), read_page_model(ListRun(events), page_modules))


@pytest.mark.skipif(NODE is None, reason="needs node")
def test_page_has_both_lives_of_goal(recorded: Path, page_modules: Path):
    model = read_page_model(open_run(recorded), page_modules)
    assert [(goal["key"], goal["parent"]) for goal in model["goals"]] == [
        ("HOUSE", ""),
        ("ROOM", "HOUSE"),
        ("HOUSE#2", ""),
        ("ROOM#2", "HOUSE#2"),
    ]
    assert {goal["key"]: goal["outcome"] for goal in model["now"]} == {
        "HOUSE": "FAILED",
        "ROOM": "FAILED",
        "HOUSE#2": "COMPLETED",
        "ROOM#2": "COMPLETED",
    }


@pytest.mark.skipif(NODE is None, reason="needs node")
def test_action_of_retried_goal_has_not_failed(page_modules: Path):
    states = ("FORMULATED", "EXECUTION-FAILED", "FAILED", "FORMULATED", "RUNNING", "FINAL")
    events = [
        made.goal(0, "g", "DISPATCHED"),
        *(made.action(1, "g", 1, "move", state) for state in states),
    ]
    assert read_page_model(ListRun(events[:4]), page_modules)["failed"] == ["1"]
    assert read_page_model(ListRun(events), page_modules)["failed"] == []
