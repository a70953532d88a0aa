"""Detection of stuck runs, and the events that a stuck run waits for.

A run is stuck if its agenda is empty, no skill runs, no rule depends on time alone, and no other program can
change anything: no remote Skiller, network, robot memory, plug-in component, or interface with a foreign
writer.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.syntax import definitions
from cxbridge.executive import sub_types
from cxbridge.executive.executive import ACTIONS_OVER
from cxbridge.executive.host.constructs import allowed_values, rule_texts
from cxbridge.run.explainers import Places
from cxbridge.run.places import places_of

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.run.agent import Run

# Features that assert facts only on request.
_QUIET_FEATURES: Final = frozenset(
    {
        "blackboard", "config", "redefine-warning", "pddl-parser", "planner", "skill-board", "navgraph",
        "motor-switch", "tf",
    }
)  # fmt: skip

# Modes in which a goal waits for a rule of its sub-type.
_BEFORE_COMMITTED: Final = frozenset({"SELECTED", "EXPANDED"})

_TIME: Final = "/clips-executive/assert-time-each-loop"


def is_stuck(agent: Run) -> bool:
    env = agent.executive.env
    if not agent.is_quiet or env.agenda_size_at_least(1) or agent.executive.skills.running:
        return False
    if not _QUIET_FEATURES.issuperset(agent.manager.loaded_features(env.name)):
        return False
    if any(slots["status"] == "RUNNING" for _, _, slots in env.facts("planner-call")):
        return False
    if any(_may_change(agent, kind, name) for kind, name in _read_interfaces(env)):
        return False
    if not _has_time(agent):
        return True
    from cxbridge.run.timed_rules import timed_rules  # noqa: PLC0415 - for runs that are stuck

    infos = agent.board.list_all()
    skillers = {info.id for info in infos if info.type == "SkillerInterface" and info.has_writer}
    return next(timed_rules(env, skillers), None) is None


def _has_time(agent: Run) -> bool:
    """Return whether each loop asserts a time fact."""
    return agent.config.get_bool(_TIME, default=False)


def _read_interfaces(env: ClipsEnvironment) -> Iterator[tuple[str, str]]:
    """Yield type and id of the interfaces read by rules."""
    for _, _, slots in env.facts("blackboard-interface"):
        if slots.get("writing") != "TRUE":
            yield str(slots["type"]), str(slots["id"])


def _may_change(agent: Run, kind: str, name: str) -> bool:
    """Return whether an interface has a writer outside of the agent."""
    if kind == "SkillerInterface":
        return False  # its Skiller is a component of this run, and idle
    infos = (info for info in agent.board.list_all() if (info.type, info.id) == (kind, name))
    return any(info.has_writer and not info.writer.startswith("CLIPS:") for info in infos)


def waits_for(agent: Run, failed_rules: Iterable[str]) -> str:
    """Return a text with the events that a run waits for and that cannot come.

    :param failed_rules: rules that ended with an error.
    """
    executive, places = agent.executive, places_of(agent, agent.executive)
    if not executive.initialized:
        causes = [*_signals(agent)] or ["the initialisation has not ended"]
    elif executive.goals.open_roots:
        causes = [*_goals(agent, places)]
    elif not executive.goals.outcomes:
        causes = ["no goal has appeared", *(_deffacts(agent) or _lacking(agent, places))]
        causes += _without_files(agent)
    else:
        causes = ["a skill or rules were not over"]
    causes += _failed_rules(agent, failed_rules)
    causes += _empty(agent)
    causes += _unwritten(agent, places)
    if not _has_time(agent):
        text = "no time passes for the rules: assert-time-each-loop is not true"
        place = agent.config.get(_TIME) if agent.config.exists(_TIME) else None
        causes.append(
            text + _place_text(f"{place.file}:{place.line}" if place is not None and place.file else "")
        )
    return "; ".join(causes)


def _signals(agent: Run) -> Iterator[str]:
    """Yield the initialisation entries that wait for a signal."""
    for _, _, slots in agent.executive.env.facts("executive-init-request"):
        if slots["state"] == "WAIT-FOR":
            signal = str(slots["wait-for"])
            yield f"{_place_of_signal(agent, signal)}{slots['name']} waits for the signal {signal}"


def _place_of_signal(agent: Run, signal: str) -> str:
    init = f"/clips-executive/specs/{agent.spec}/init/"
    for item in agent.config.search(init):
        if item.path.endswith("/wait-for") and item.text == signal and item.file:
            return f"{item.file}:{item.line}: "
    return ""


def _place_text(place: str) -> str:
    return f" ({place})" if place else ""


def _goals(agent: Run, places: Places) -> Iterator[str]:
    """Yield the open goals with their unfinished plan-actions."""
    env, goals = agent.executive.env, agent.executive.goals
    modes = allowed_values(env, "goal", "mode")
    classes = {str(slots["id"]): str(slots["class"]) for _, _, slots in env.facts("goal")}
    unhandled = _unhandled_sub_types(agent)
    below = (goal for goal in goals.open.values() if not goal.is_root and goal.goal in unhandled)
    for goal in (*goals.open_roots, *below):
        is_mode = not modes or goal.mode in modes
        place = _place_text(places.of_goal(classes.get(goal.goal, ""), goal.mode))
        why = unhandled.get(goal.goal, "") if is_mode else ", which is not a mode of goals"
        yield f"{goal.goal} is {goal.mode}{place}{why}"
    known = goals.open
    for _, _, slots in env.facts("plan-action"):
        if str(slots["goal-id"]) in known and slots["state"] not in ACTIONS_OVER:
            values = slots["param-values"]
            words = " ".join(map(str, values)) if isinstance(values, tuple) else ""
            place = _place_text(places.of_action(str(slots["action-name"])))
            yield f"action {slots['action-name']} {words}".rstrip() + f" is {slots['state']}{place}"
    shown = env.facts("SkillerInterface") if env.has_template("SkillerInterface") else ()
    controllers = {slots["id"]: slots["exclusive_controller"] for _, _, slots in shown}
    for _, _, slots in env.facts("skiller-control"):
        if slots["acquired"] != "TRUE":
            yield f"{controllers.get(slots['skiller']) or 'nobody'} has control of {slots['skiller']}"
    if not any(True for _ in env.facts("skiller-control")) and env.has_template("skiller-control"):
        yield "no (skiller-control) asks for control of a Skiller"


def _unhandled_sub_types(agent: Run) -> dict[str, str]:
    """Return, by goal id, a text about each goal whose sub-type has no rule."""
    from cxbridge.run.timed_rules import condition_of_rule  # noqa: PLC0415 - for runs that are stuck

    env = agent.executive.env
    waiting = {
        str(slots["id"]): sub_type
        for _, _, slots in env.facts("goal")
        if slots.get("mode") in _BEFORE_COMMITTED
        and (sub_type := str(slots.get(sub_types.SLOT, sub_types.NONE))) != sub_types.NONE
    }
    rules = rule_texts(env).values() if waiting else ()
    known = {name for rule in rules for name in sub_types.handled(condition_of_rule(rule))}
    files = sub_types.files_of_core(*agent.paths.before, agent.paths.cx)
    found = {}
    for goal, sub_type in waiting.items():
        if sub_type not in known:
            hint = sub_types.advice(sub_type, known, files)
            found[goal] = f", and no rule handles its sub-type {sub_type}" + (f": {hint}" if hint else "")
    return found


def _without_files(agent: Run) -> Iterator[str]:
    """Yield a text if the spec loads no file, with the place of the spec."""
    base, chosen = f"/clips-executive/specs/{agent.spec}", "/clips-executive/spec"
    if any("/file" in value.path.removeprefix(base) for value in agent.config.search(f"{base}/init")):
        return
    spec = next(agent.config.search(base), None)
    if spec is None and agent.config.exists(chosen):
        spec = agent.config.get(chosen)
    place = f"{spec.file}:{spec.line}" if spec is not None and spec.file else ""
    yield f"the init of the spec {agent.spec} names no file{_place_text(place)}"


def _empty(agent: Run) -> Iterator[str]:
    """Yield a text for each loaded file without content."""
    for file in dict.fromkeys(agent.executive.env.loader.files):
        if file.exists() and not file.stat().st_size:
            yield f"{file}:1: the file is empty"


def _lacking(agent: Run, places: Places) -> list[str]:
    """Return the missing fact of the first rule that makes goals."""
    from cxbridge.run.timed_rules import lacking  # noqa: PLC0415 - for runs that are stuck

    for rule in places.rules_that_make_goals():
        template = lacking(agent.executive.env, rule)
        if template:
            hint = places.of_similar_fact(template)
            text = f"rule {rule} lacks a fact ({template}){_place_text(_place_of_rule(agent, rule))}"
            return [text, *([hint] if hint else [])]
    return []


def _deffacts(agent: Run) -> list[str]:
    # Fawkes loads files without a reset, which alone would assert deffacts
    found: list[str] = []
    for file in agent.executive.env.loader.files:
        if file.is_relative_to(agent.paths.cx) or file.is_relative_to(agent.paths.library):
            continue
        found += (
            f"{file}:{line}: the facts of deffacts {name} are not there, for nothing resets the "
            "environment: assert them in a rule"
            for name, line in _definitions(file, "deffacts")
        )
    return found


def _definitions(file: Path, kind: str) -> Iterator[tuple[str, int]]:
    try:
        text = file.read_text("utf-8", "surrogateescape")
    except OSError:
        return
    yield from (
        (definition.name, definition.line) for definition in definitions(text) if definition.kind == kind
    )


def _place_of_rule(agent: Run, rule: str) -> str:
    found = agent.executive.env.loader.place_of(rule)
    return "" if found is None else f"{found[0]}:{found[1]}"


def _failed_rules(agent: Run, rules: Iterable[str]) -> Iterator[str]:
    for rule in rules:
        if place := _place_of_rule(agent, rule):
            yield f"{place}: an error has ended the actions of rule {rule}"


def _unwritten(agent: Run, places: Places) -> Iterator[str]:
    """Yield a text for each interface that rules read and no writer writes."""
    written = {info.uid for info in agent.board.list_all() if info.has_writer}
    for kind, name in _read_interfaces(agent.executive.env):
        if f"{kind}::{name}" not in written:
            yield f"{kind}::{name} has no writer{_place_text(places.of_interface(kind, name))}"
