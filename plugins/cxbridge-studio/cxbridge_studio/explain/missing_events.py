"""Describes the events that a stuck run waits for, and the agent's probable mistakes.

A text about an event names the line in the agent's files that caused the wait (``FILE:LINE``), if a file
contains the name of the goal, action, interface or signal.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Final

from cxbridge.executive.executive import FINAL_ACTION_STATES
from cxbridge.run.mistakes import own_files
from cxbridge.run.stuck import find_read_interfaces
from cxbridge_studio.agent import sub_types
from cxbridge_studio.constructs import read_allowed_values, read_rule_texts
from cxbridge_studio.explain.source_positions import SourcePositions
from cxbridge_studio.explain.timed_rules import (
    TIME_KEY,
    find_missing_template,
    has_time_facts,
    parse_rule_condition,
)

if TYPE_CHECKING:
    from cxbridge.run.agent import Run

# Modes in which a goal waits for a rule of its sub-type.
_SUB_TYPE_MODES: Final = frozenset({"SELECTED", "EXPANDED"})


def describe_missing_events(agent: Run, failed_rules: Iterable[str]) -> str:
    """Return a text with the events that a stuck agent waits for.

    :param failed_rules: the rules whose actions ended with an error.
    """
    return "; ".join(_describe_causes(agent, failed_rules))


def _describe_causes(agent: Run, failed_rules: Iterable[str]) -> Iterator[str]:
    """Yield the missing events, then the agent's probable mistakes."""
    executive, positions = agent.executive, SourcePositions(own_files(agent, agent.executive))
    if not executive.is_initialized:
        yield from [*_describe_signals(agent)] or ["the initialisation has not ended"]
    elif executive.goals.open_roots:
        yield from _describe_goals(agent, positions)
        yield from _describe_actions(agent, positions)
        yield from _describe_control_requests(agent)
    elif not executive.goals.outcome_counts:
        yield "no goal has appeared"
        # As in Fawkes, nothing resets the environment, and only a reset asserts deffacts.
        yield from [
            f"{position}: the facts of deffacts {name} do not exist, "
            "because nothing resets the environment: assert them in a rule"
            for name, position in positions.find_deffacts()
        ] or _describe_missing_fact(agent, positions)
        yield from _describe_empty_spec(agent)
    else:
        yield "a skill or a rule had not ended"
    for rule in failed_rules:
        if position := _find_rule_position(agent, rule):
            yield f"{position}: an error has ended the actions of rule {rule}"
    for file in dict.fromkeys(executive.env.loader.files):
        if file.exists() and not file.stat().st_size:
            yield f"{file}:1: the file is empty"
    yield from _describe_unwritten_interfaces(agent, positions)
    if not has_time_facts(agent):
        position = agent.config.get(TIME_KEY).location if agent.config.exists(TIME_KEY) else ""
        yield f"no time passes for the rules: assert-time-each-loop is not true{_add_brackets(position)}"


def _add_brackets(position: str) -> str:
    return f" ({position})" if position else ""


def _describe_signals(agent: Run) -> Iterator[str]:
    """Yield a text about each initialisation entry that waits for a signal."""
    init_values = [*agent.config.search(f"/clips-executive/specs/{agent.spec}/init/")]
    for _, _, slots in agent.executive.env.facts("executive-init-request"):
        if slots["state"] == "WAIT-FOR":
            signal = str(slots["wait-for"])
            position_prefixes = (
                f"{value.location}: "
                for value in init_values
                if value.path.endswith("/wait-for") and value.text == signal and value.location
            )
            yield f"{next(position_prefixes, '')}{slots['name']} waits for the signal {signal}"


def _describe_goals(agent: Run, positions: SourcePositions) -> Iterator[str]:
    """Yield a text about each open root goal, and about each sub-goal whose sub-type has no rule."""
    env, goals = agent.executive.env, agent.executive.goals
    modes = read_allowed_values(env, "goal", "mode")
    classes = {str(slots["id"]): str(slots["class"]) for _, _, slots in env.facts("goal")}
    texts_by_goal = _describe_unhandled_sub_types(agent)
    sub_goals = (
        goal for goal in goals.open_goals.values() if not goal.is_root and goal.goal in texts_by_goal
    )
    for goal in (*goals.open_roots, *sub_goals):
        is_known_mode = not modes or goal.mode in modes
        position = _add_brackets(positions.find_goal_position(classes.get(goal.goal, ""), goal.mode))
        reason = texts_by_goal.get(goal.goal, "") if is_known_mode else ", which is not a mode of goals"
        yield f"{goal.goal} is {goal.mode}{position}{reason}"


def _describe_actions(agent: Run, positions: SourcePositions) -> Iterator[str]:
    """Yield a text about each unfinished plan-action of an open goal."""
    open_goals = agent.executive.goals.open_goals
    for _, _, slots in agent.executive.env.facts("plan-action"):
        if str(slots["goal-id"]) in open_goals and slots["state"] not in FINAL_ACTION_STATES:
            position = _add_brackets(positions.find_action_position(str(slots["action-name"])))
            action = " ".join(map(str, (slots["action-name"], *slots["param-values"])))
            yield f"action {action} is {slots['state']}{position}"


def _describe_control_requests(agent: Run) -> Iterator[str]:
    """Yield a text about each Skiller whose control the agent lacks, or about a missing request."""
    env = agent.executive.env
    skillers = env.facts("SkillerInterface") if env.has_template("SkillerInterface") else ()
    controllers = {slots["id"]: slots["exclusive_controller"] for _, _, slots in skillers}
    controls = [slots for _, _, slots in env.facts("skiller-control")]
    for slots in controls:
        if slots["acquired"] != "TRUE":
            yield f"{controllers.get(slots['skiller']) or 'no client'} has control of {slots['skiller']}"
    if not controls and env.has_template("skiller-control"):
        yield "no fact (skiller-control) asks for the control of a Skiller"


def _describe_unhandled_sub_types(agent: Run) -> dict[str, str]:
    """Return a text about each goal whose sub-type no rule handles, by goal id."""
    env = agent.executive.env
    sub_types_by_goal = {
        str(slots["id"]): sub_type
        for _, _, slots in env.facts("goal")
        if slots.get("mode") in _SUB_TYPE_MODES
        and (sub_type := str(slots.get(sub_types.SUB_TYPE_SLOT, sub_types.NO_SUB_TYPE)))
        != sub_types.NO_SUB_TYPE
    }
    rules = read_rule_texts(env).values() if sub_types_by_goal else ()
    handled_sub_types = {
        name for rule in rules for name in sub_types.find_handled_sub_types(parse_rule_condition(rule))
    }
    files = sub_types.find_core_files(*agent.paths.override_dirs, agent.paths.core_dir)
    hints = {
        sub_type: sub_types.make_hint(sub_type, handled_sub_types, files)
        for sub_type in {*sub_types_by_goal.values()} - handled_sub_types
    }
    return {
        goal: f", and no rule handles its sub-type {sub_type}"
        + (f": {hints[sub_type]}" if hints[sub_type] else "")
        for goal, sub_type in sub_types_by_goal.items()
        if sub_type in hints
    }


def _describe_empty_spec(agent: Run) -> Iterator[str]:
    """Yield a text with the position of the spec if its initialisation loads no file."""
    config, spec_path = agent.config, f"/clips-executive/specs/{agent.spec}"
    if any("/file" in value.path.removeprefix(spec_path) for value in config.search(f"{spec_path}/init")):
        return
    paths = (spec_path, "/clips-executive/spec")
    positions = (value.location for path in paths for value in config.search(path))
    yield f"the init of the spec {agent.spec} names no file{_add_brackets(next(positions, ''))}"


def _describe_missing_fact(agent: Run, positions: SourcePositions) -> list[str]:
    """Return texts about the first goal-asserting rule that lacks a fact: that fact, and a similar fact."""
    for rule in positions.find_goal_asserting_rules():
        if template := find_missing_template(agent.executive.env, rule):
            position = _add_brackets(_find_rule_position(agent, rule))
            hint = positions.make_similar_fact_hint(template)
            return [f"rule {rule} lacks a fact ({template}){position}", *([hint] if hint else [])]
    return []


def _find_rule_position(agent: Run, rule: str) -> str:
    """Return the position of a rule; empty if the agent's loader has not loaded the rule."""
    position = agent.executive.env.loader.rule_location(rule)
    return "" if position is None else ":".join(map(str, position))  # FILE:LINE


def _describe_unwritten_interfaces(agent: Run, positions: SourcePositions) -> Iterator[str]:
    """Yield a text about each interface that rules read and that has no writer."""
    written_uids = {interface.uid for interface in agent.board.list_all() if interface.has_writer}
    for interface_type, interface_id in find_read_interfaces(agent.executive.env):
        uid = f"{interface_type}::{interface_id}"
        if uid not in written_uids:
            position = _add_brackets(positions.find_interface_position(interface_type, interface_id))
            yield f"{uid} has no writer{position}"
