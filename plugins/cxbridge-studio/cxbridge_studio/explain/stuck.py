"""Detection of a run in which no event can follow, and the events that it waits for.

A run is stuck if its agenda is empty, no skill runs, no rule depends on time alone, and no other program can
change anything: no remote Skiller, network, robot memory, plug-in component, or interface with a foreign
writer. Such a run ends before its timeout, and its result names the missing events.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.condition import CE, GroupCE, PatternCE, condition_of
from cxbridge.clipstext.syntax import definitions, read
from cxbridge.executive import sub_types
from cxbridge.executive.executive import FINAL_ACTION_STATES
from cxbridge.executive.host.constructs import allowed_values, rule_texts
from cxbridge.run.mistakes import places_of

if TYPE_CHECKING:
    from cxbridge.events import Event
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge.run.agent import Run
    from cxbridge.run.explainers import Places
    from cxbridge.run.team import Team

# Features that assert facts only on request of a rule.
_QUIET_FEATURES: Final = frozenset(
    {
        "blackboard", "config", "redefine-warning", "pddl-parser", "planner", "skill-board", "navgraph",
        "motor-switch", "tf",
    }
)  # fmt: skip

# Core rules that fire in each cycle without further effect.
_TICK_RULES: Final = frozenset({"time-retract", "blackboard-read"})

# The core rule that requests control of a Skiller periodically.
_CONTROL_RULE: Final = "skill-control-acquire"

# Modes in which a goal waits for a rule of its sub-type.
_BEFORE_COMMITTED: Final = frozenset({"SELECTED", "EXPANDED"})

# The start of CLIPS' message that names the rule of an error.
_HALTED: Final = "[PRCCODE4]"

_TIME_TEMPLATE: Final = "time"
_TIME_KEY: Final = "/clips-executive/assert-time-each-loop"
_QUIET_LOOPS: Final = 15  # number of cycles before the first check: half a second at Fawkes' period


class StuckWatch:
    """Checks periodically whether the agents of a run can still change anything.

    :param run: the run, whose agents may change.
    :param on: whether to check at all; False if a user or a client may cause changes.
    """

    def __init__(self, run: Run | Team, *, on: bool) -> None:
        self._run, self._is_on = run, on
        self._agents: Sequence[Run] = run.agents
        self._fired = self._quiet_loops = 0
        self._next_check = _QUIET_LOOPS

    def look(self) -> bool:
        """Return whether the run is stuck. To be called after each cycle."""
        # a check takes milliseconds: it waits for some cycles without firings except those of each tick, and
        # for twice as many after each negative result
        agents, fired_before = self._run.agents, self._fired
        self._fired = sum(agent.firings for agent in agents)
        is_quiet = self._is_on and self._fired - fired_before <= len(_TICK_RULES) * len(agents)
        if agents != self._agents or not is_quiet:
            self._agents = agents
            self._quiet_loops, self._next_check = 0, _QUIET_LOOPS
        self._quiet_loops += is_quiet
        if self._quiet_loops < self._next_check:
            return False
        self._next_check *= 2
        return all(agent.is_over or is_stuck(agent) for agent in agents)


class RuleErrors:
    """Collects the names of rules with errors, in order, from CLIPS' log lines. Subscribes to ``LogLine``."""

    def __init__(self) -> None:
        self.rules: dict[str, None] = {}

    def __call__(self, event: Event) -> None:
        text = getattr(event, "text", "")
        if text.startswith(_HALTED) and "'" in text:
            self.rules[text.split("'")[1]] = None


def is_stuck(agent: Run) -> bool:
    """Return whether no event can follow for an agent."""
    env = agent.executive.env
    if not agent.is_quiet or env.has_activations(1) or agent.executive.skills.running:
        return False
    if not _QUIET_FEATURES.issuperset(agent.manager.loaded_features(env.name)):
        return False
    if any(slots["status"] == "RUNNING" for _, _, slots in env.facts("planner-call")):
        return False
    if any(_has_foreign_writer(agent, kind, name) for kind, name in _read_interfaces(env)):
        return False
    infos = agent.board.list_all()
    skillers = {info.id for info in infos if info.type == "SkillerInterface" and info.has_writer}
    return not _has_time(agent) or next(_timed_rules(env, skillers), None) is None


def _has_time(agent: Run) -> bool:
    """Return whether each cycle asserts a time fact."""
    return agent.config.get_bool(_TIME_KEY, default=False)


def _read_interfaces(env: ClipsEnvironment) -> Iterator[tuple[str, str]]:
    """Yield type and id of the interfaces read by rules."""
    for _, _, slots in env.facts("blackboard-interface"):
        if slots.get("writing") != "TRUE":
            yield str(slots["type"]), str(slots["id"])


def _has_foreign_writer(agent: Run, kind: str, name: str) -> bool:
    """Return whether an interface may be written by another program than the rules."""
    if kind == "SkillerInterface":
        return False  # its Skiller is a component of this run, and idle
    infos = (info for info in agent.board.list_all() if (info.type, info.id) == (kind, name))
    return any(info.has_writer and not info.writer.startswith("CLIPS:") for info in infos)


# -- rules that time alone can activate


def _timed_rules(env: ClipsEnvironment, skillers: Collection[str]) -> Iterator[str]:
    """Yield the rules with a ``time`` pattern whose other facts exist.

    In doubt a rule counts, which only delays the end of the run until the timeout: a rule is excluded only by
    a pattern without any matching fact. Joins, tests and negated patterns count as satisfied.

    :param skillers: the names of the existing Skillers.
    """
    for name, text in rule_texts(env).items():
        if f"({_TIME_TEMPLATE} " not in text or name in _TICK_RULES:
            continue
        if name == _CONTROL_RULE and not _can_get_control(env, skillers):
            continue
        if all(_may_hold(env, element) for element in _condition_of(text)):
            yield name


def _missing_template(env: ClipsEnvironment, rule: str) -> str:
    """Return the deftemplate of the first missing fact of a rule; empty if no fact is known to be missing."""
    for element in _condition_of(rule_texts(env).get(rule, "")):
        if isinstance(element, PatternCE) and not _may_hold(env, element):
            return element.template
    return ""


@lru_cache(maxsize=1024)  # each check of a run parses the same rules
def _condition_of(rule: str) -> tuple[CE, ...]:
    """Return the condition of a rule's text; empty if it is nested too deeply for the parser."""
    try:
        return tuple(element for node in read(rule) for element in condition_of(node))
    except RecursionError:
        return ()


def _can_get_control(env: ClipsEnvironment, skillers: Collection[str]) -> bool:
    """Return whether a Skiller with an open control request exists."""
    # SkillerInterface may have no fact yet: the Skiller writes nothing until a client has control
    controls = (slots for _, _, slots in env.facts("skiller-control"))
    return any(slots["acquired"] == "FALSE" and str(slots["skiller"]) in skillers for slots in controls)


def _may_hold(env: ClipsEnvironment, element: CE) -> bool:
    """Return whether existing facts and any time fact may satisfy a conditional element."""
    if isinstance(element, GroupCE):
        if element.kind in ("and", "logical", "exists"):
            return all(_may_hold(env, item) for item in element.items)
        return element.kind != "or" or any(_may_hold(env, item) for item in element.items)
    if not isinstance(element, PatternCE) or element.template == _TIME_TEMPLATE:
        return True
    symbols = {
        slot: words
        for slot, words in element.slots.items()
        if all(word[0].isalpha() for word in words)  # a number has several spellings
    }
    return any(_fits(slots, symbols) for _, _, slots in env.facts(element.template))


def _fits(slots: Mapping[str, Value], symbols: Mapping[str, frozenset[str]]) -> bool:
    """Return whether a fact has one of the permitted symbols in each of these slots."""
    return all(
        slot not in slots or isinstance(slots[slot], tuple) or str(slots[slot]) in words
        for slot, words in symbols.items()
    )


# -- the missing events


def waits_for(agent: Run, failed_rules: Iterable[str]) -> str:
    """Return a text with the events that a run waits for and that cannot come.

    :param failed_rules: rules that ended with an error.
    """
    executive, places = agent.executive, places_of(agent, agent.executive)
    if not executive.initialized:
        causes = [*_signals(agent)] or ["the initialisation has not ended"]
    elif executive.goals.open_roots:
        causes = [*_goals(agent, places), *_actions(agent, places), *_controls(agent)]
    elif not executive.goals.outcomes:
        causes = ["no goal has appeared", *(list(_deffacts(agent)) or _missing_fact(agent, places))]
        causes += _spec_without_files(agent)
    else:
        causes = ["a skill or rules were not over"]
    for rule in failed_rules:
        if place := _place_of_rule(agent, rule):
            causes.append(f"{place}: an error has ended the actions of rule {rule}")
    files = dict.fromkeys(executive.env.loader.files)
    causes += [f"{file}:1: the file is empty" for file in files if file.exists() and not file.stat().st_size]
    causes += _unwritten_interfaces(agent, places)
    if not _has_time(agent):
        place = agent.config.get(_TIME_KEY).location if agent.config.exists(_TIME_KEY) else ""
        causes.append(
            f"no time passes for the rules: assert-time-each-loop is not true{_in_parentheses(place)}"
        )
    return "; ".join(causes)


def _in_parentheses(place: str) -> str:
    return f" ({place})" if place else ""


def _signals(agent: Run) -> Iterator[str]:
    """Yield the initialisation entries that wait for a signal."""
    entries = [*agent.config.search(f"/clips-executive/specs/{agent.spec}/init/")]
    for _, _, slots in agent.executive.env.facts("executive-init-request"):
        if slots["state"] == "WAIT-FOR":
            signal = str(slots["wait-for"])
            places = (
                item.location for item in entries if item.path.endswith("/wait-for") and item.text == signal
            )
            place = next(filter(None, places), "")
            yield f"{place}{': ' if place else ''}{slots['name']} waits for the signal {signal}"


def _goals(agent: Run, places: Places) -> Iterator[str]:
    """Yield the open root goals, and the sub-goals whose sub-type has no rule."""
    env, goals = agent.executive.env, agent.executive.goals
    modes = allowed_values(env, "goal", "mode")
    classes = {str(slots["id"]): str(slots["class"]) for _, _, slots in env.facts("goal")}
    unhandled = _unhandled_sub_types(agent)
    sub_goals = (goal for goal in goals.open.values() if not goal.is_root and goal.goal in unhandled)
    for goal in (*goals.open_roots, *sub_goals):
        is_mode = not modes or goal.mode in modes
        place = _in_parentheses(places.of_goal(classes.get(goal.goal, ""), goal.mode))
        why = unhandled.get(goal.goal, "") if is_mode else ", which is not a mode of goals"
        yield f"{goal.goal} is {goal.mode}{place}{why}"


def _actions(agent: Run, places: Places) -> Iterator[str]:
    """Yield the unfinished plan-actions of open goals."""
    open_goals = agent.executive.goals.open
    for _, _, slots in agent.executive.env.facts("plan-action"):
        if str(slots["goal-id"]) in open_goals and slots["state"] not in FINAL_ACTION_STATES:
            values = slots["param-values"]
            words = " ".join(map(str, values)) if isinstance(values, tuple) else ""
            place = _in_parentheses(places.of_action(str(slots["action-name"])))
            yield f"action {slots['action-name']} {words}".rstrip() + f" is {slots['state']}{place}"


def _controls(agent: Run) -> Iterator[str]:
    """Yield the Skillers of which the agent has no control."""
    env = agent.executive.env
    skillers = env.facts("SkillerInterface") if env.has_template("SkillerInterface") else ()
    controllers = {slots["id"]: slots["exclusive_controller"] for _, _, slots in skillers}
    controls = [slots for _, _, slots in env.facts("skiller-control")]
    for slots in controls:
        if slots["acquired"] != "TRUE":
            yield f"{controllers.get(slots['skiller']) or 'no client'} has control of {slots['skiller']}"
    if not controls and env.has_template("skiller-control"):
        yield "no (skiller-control) asks for control of a Skiller"


def _unhandled_sub_types(agent: Run) -> dict[str, str]:
    """Return, by goal id, a text about each goal whose sub-type has no rule."""
    env = agent.executive.env
    waiting = {
        str(slots["id"]): sub_type
        for _, _, slots in env.facts("goal")
        if slots.get("mode") in _BEFORE_COMMITTED
        and (sub_type := str(slots.get(sub_types.SLOT, sub_types.NONE))) != sub_types.NONE
    }
    rules = rule_texts(env).values() if waiting else ()
    handled = {name for rule in rules for name in sub_types.handled(_condition_of(rule))}
    files = sub_types.files_of_core(*agent.paths.before, agent.paths.cx)
    texts = {}
    for goal, sub_type in waiting.items():
        if sub_type not in handled:
            hint = sub_types.advice(sub_type, handled, files)
            texts[goal] = f", and no rule handles its sub-type {sub_type}" + (f": {hint}" if hint else "")
    return texts


def _spec_without_files(agent: Run) -> Iterator[str]:
    """Yield a text if the spec loads no file, with the place of the spec."""
    config, base = agent.config, f"/clips-executive/specs/{agent.spec}"
    if any("/file" in value.path.removeprefix(base) for value in config.search(f"{base}/init")):
        return
    spec = next(config.search(base), None)
    if spec is None and config.exists("/clips-executive/spec"):
        spec = config.get("/clips-executive/spec")
    place = "" if spec is None else spec.location
    yield f"the init of the spec {agent.spec} names no file{_in_parentheses(place)}"


def _missing_fact(agent: Run, places: Places) -> list[str]:
    """Return the missing fact of the first rule that makes goals."""
    for rule in places.rules_that_make_goals():
        if template := _missing_template(agent.executive.env, rule):
            place = _in_parentheses(_place_of_rule(agent, rule))
            hint = places.of_similar_fact(template)
            return [f"rule {rule} lacks a fact ({template}){place}", *([hint] if hint else [])]
    return []


def _deffacts(agent: Run) -> Iterator[str]:
    """Yield the deffacts of the agent's files."""
    # Fawkes loads files without a reset, which alone would assert deffacts
    for file in agent.executive.env.loader.files:
        if file.is_relative_to(agent.paths.cx) or file.is_relative_to(agent.paths.library):
            continue
        try:
            text = file.read_text("utf-8", "surrogateescape")
        except OSError:
            continue
        for construct in definitions(text):
            if construct.kind == "deffacts":
                yield (
                    f"{file}:{construct.line}: the facts of deffacts {construct.name} are not there, "
                    "for nothing resets the environment: assert them in a rule"
                )


def _place_of_rule(agent: Run, rule: str) -> str:
    place = agent.executive.env.loader.rule_location(rule)
    return "" if place is None else f"{place[0]}:{place[1]}"


def _unwritten_interfaces(agent: Run, places: Places) -> Iterator[str]:
    """Yield a text for each interface that rules read and no writer writes."""
    written = {info.uid for info in agent.board.list_all() if info.has_writer}
    for kind, name in _read_interfaces(agent.executive.env):
        if f"{kind}::{name}" not in written:
            yield f"{kind}::{name} has no writer{_in_parentheses(places.of_interface(kind, name))}"
