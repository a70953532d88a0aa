"""The page with an embedded recording or JSON document: a single file that needs no server."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.linking import find_skill_links
from cxbridge.run.explainers import make_explainer
from cxbridge.trace.codec import encode_with_kind
from cxbridge.trace.formats.base import Run
from cxbridge_web.pages import make_page

MCAP: Final = "mcap"  # the format that the page reads without conversion

# The number of unfinished or failed goals of an environment whose explanations a report contains:
# each explanation takes time and space.
MAX_EXPLANATIONS: Final = 20


def report(run: Run, title: str = "") -> str:
    """Return the page with an embedded run.

    :param title: the name of the run on the page; by default the name of its file.
    :raises TraceError: if the run cannot be read.
    """
    data = run.path.read_bytes() if run.format == MCAP else b"".join(encode_lines(run))
    name = title or run.path.name or "run"
    # before the use of `run.notes`, which reading the run fills
    history = RunHistory.from_events(run, UNLIMITED, run.start_us)
    description = {
        "name": name,
        "links": list_guessed_links(history),
        "notes": run.notes,
        "answers": _make_explanations(run, history),
    }
    return make_page(name, data, description)


def _make_explanations(run: Run, history: RunHistory) -> dict[str, Any]:
    """Return the story of a run and the explanations of its unfinished and failed goals, by question.

    With several agents, a question begins with the agent's environment. Empty if an explanation fails, as
    without a plug-in that explains runs.
    """
    environments: list[str | None] = [*dict.fromkeys(goal.env for goal in history.goals)] or [None]
    explanations: dict[str, Any] = {}
    try:
        for env in environments:
            explain = make_explainer(run, env=env)
            agent_prefix = f"{env} " if len(environments) > 1 else ""
            troubled_goals = [
                goal.name
                for goal in history.goals
                if goal.env == env and (goal.end_change is None or goal.outcome == "FAILED")
            ]
            explanations[f"{agent_prefix}run"] = explain("run", "")["data"]
            for name in troubled_goals[:MAX_EXPLANATIONS]:
                explanations[f"{agent_prefix}goal {name}"] = explain("goal", name)["data"]
    except (CxbridgeError, RecursionError):  # RecursionError: thousands of nested goals
        return {}
    return explanations


def document_page(kind: str, title: str, document: Mapping[str, Any]) -> str:
    """Return the page with an embedded JSON document.

    :param kind: the name of the module of ``static/js/documents`` that shows the document.
    """
    return make_page(title, json.dumps(document).encode("utf-8"), {"kind": kind, "name": title})


def encode_lines(run: Run) -> Iterator[bytes]:
    """Yield a run as JSON lines, like ``trace cat --json``."""
    return (encode_with_kind(event) + b"\n" for event in run if event.KIND.name)


def list_guessed_links(history: RunHistory) -> list[list[Any]]:
    """Return the guessed pairs of plan-actions and skill calls, which the recording lacks.

    :returns: for each pair the environment, goal, plan and id of the action, then the Skiller, skill string,
        message id and begin (in microseconds) of the skill call.
    """
    start_us = history.clock.start_us or 0  # without events there are no links either
    return [
        [
            *(link.action.env, link.action.goal, link.action.plan, link.action.id),
            *(link.call.skiller, link.call.skill_string, link.call.msgid, start_us + link.call.begin.time),
        ]
        for link in find_skill_links(history)
        if link.is_guessed
    ]
