"""Monitors of plan-actions: preconditions hold when an action starts, and nothing is executed twice."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

from cxbridge_explore.properties.monitor import Monitor, Scene
from cxbridge_explore.properties.tables import FactTables
from cxbridge_studio.explain.preconditions import Atom, Preconditions, ground_predicate, parse_fields

_ACTION_SLOTS: Final = ("goal-id", "plan-id", "id", "action-name", "state", "param-names", "param-values")
_UNSTARTED_STATES: Final = frozenset({"FORMULATED", "PENDING"})
# In the state WAITING, the skill of the action has been called, but does not run yet.
_STARTED_STATES: Final = frozenset({"WAITING", "RUNNING"})

ActionKey = tuple[str, str, str, str]  # environment, and the ids of goal, plan and action

Literal = tuple[bool, Atom]  # an atom that an effect makes true or false


@dataclass(frozen=True, slots=True)
class ObservedAction:
    """A plan-action that a monitor observes.

    :param arguments: the values by parameter.
    """

    key: ActionKey
    name: str
    arguments: Mapping[str, str]

    @property
    def text(self) -> str:
        """The name and the arguments, separated by spaces."""
        return " ".join((self.name, *self.arguments.values()))

    @property
    def goal(self) -> str:
        _environment, goal, _plan, _action = self.key
        return goal


def _drop_agent(values: Mapping[ActionKey, str], agent: str) -> dict[ActionKey, str]:
    """Return the values by action, such as states, without those of an agent."""
    return {
        (environment, goal, plan, action): value
        for (environment, goal, plan, action), value in values.items()
        if environment != agent
    }


class ActionMonitor(Monitor):
    """The base class of monitors of plan-actions, whose states it follows."""

    # followed so that their facts are cached, see `FactTables.follow`
    templates = ("domain-operator", "domain-effect", "domain-fact", "pddl-formula", "pddl-predicate")

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._states: dict[ActionKey, str] = {}

    def joined(self, tables: FactTables) -> None:
        """Watch the actions and the domain of an agent."""
        super().joined(tables)
        tables.env.watcher.follow("plan-action", partial(self._handle_action_fact, tables), _ACTION_SLOTS)

    def left(self, tables: FactTables) -> None:
        """Forget the actions of an agent, whose ids a restarted agent may reuse."""
        self._states = _drop_agent(self._states, tables.name)

    def _handle_action_fact(self, tables: FactTables, _template: str, slots: Mapping[str, str]) -> None:
        try:
            key = tables.name, slots["goal-id"], slots["plan-id"], slots["id"]
            state, earlier_state = slots["state"], self._states.get(key)
        except KeyError:
            return  # the agent's deftemplate of this name has other slots
        if state == earlier_state:  # a modification of another slot has asserted the fact again
            return
        self._states[key] = state
        if state in _STARTED_STATES and earlier_state not in _STARTED_STATES:
            self.on_start(tables, self._make_action(tables, key, slots))
        elif state == "FINAL":
            self.on_end(tables, self._make_action(tables, key, slots))
        elif state in _UNSTARTED_STATES:
            self.on_wait(key)

    @staticmethod
    def _make_action(tables: FactTables, key: ActionKey, slots: Mapping[str, str]) -> ObservedAction:
        name = slots["action-name"]
        names, values = (
            parse_fields(slots.get("param-names", "")),
            parse_fields(slots.get("param-values", "")),
        )
        # An agent may assert an action without the names of its parameters; the operator has the names.
        for operator in () if names else tables.printed_facts("domain-operator"):
            if operator["name"] == name:
                names = parse_fields(operator["param-names"])
        # not strict, since rules may assert any number of names and values
        return ObservedAction(key, name, dict(zip(names, values, strict=False)))

    @abstractmethod
    def on_start(self, tables: FactTables, action: ObservedAction) -> None:
        """Handle the start of an action."""

    def on_wait(self, key: ActionKey) -> None:
        """Handle an action that waits for its start: a new action, or an action that the agent retries."""

    def on_end(self, tables: FactTables, action: ObservedAction) -> None:
        """Handle the successful end of an action, after its effects were applied."""


class PreconditionMonitor(ActionMonitor):
    """Checks that no action starts with a false precondition."""

    def on_start(self, tables: FactTables, action: ObservedAction) -> None:
        if not any(formula["part-of"] == action.name for formula in tables.printed_facts("pddl-formula")):
            return
        self.is_evaluated = True
        false_formulas = Preconditions(tables.printed_facts).describe_blame(action.name, action.arguments)
        if false_formulas:
            self.scene.report(
                f"{action.text} of {action.goal} starts while its precondition does not hold: "
                + ", ".join(false_formulas),
                goal=action.goal,
                action=action.text,
            )


class SingleExecutionMonitor(ActionMonitor):
    """Checks that nothing is executed twice.

    A plan-action has one skill call, unless the agent resets the action for a retry. No action starts if an
    action of the same operator has achieved the same effects, even for another goal or with another robot,
    and the effects still hold. An action without effects or with a conditional effect may be repeated.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._calls: dict[ActionKey, str] = {}  # id of the skill call by action
        # By operator and achieved effects: a text about the executed action.
        self._achievers: dict[tuple[str, frozenset[Literal]], str] = {}

    def joined(self, tables: FactTables) -> None:
        """Watch the actions, the calls of skills, and the facts that undo an effect."""
        super().joined(tables)
        watcher = tables.env.watcher
        slots = ("goal-id", "plan-id", "action-id", "skill-id", "skill-name")
        watcher.follow("skill-action-execinfo", partial(self._handle_call_fact, tables), slots)
        watcher.follow("domain-fact", partial(self._undo_literal, is_true=False), ("name", "param-values"))
        watcher.follow_retractions(
            "domain-fact", partial(self._undo_literal, is_true=True), ("name", "param-values")
        )

    def left(self, tables: FactTables) -> None:
        """Forget the calls of an agent, but keep the achieved effects."""
        super().left(tables)
        self._calls = _drop_agent(self._calls, tables.name)

    def _handle_call_fact(self, tables: FactTables, _template: str, slots: Mapping[str, str]) -> None:
        goal, action = slots["goal-id"], slots["action-id"]
        key = tables.name, goal, slots["plan-id"], action
        skill_id = self._calls.setdefault(key, slots["skill-id"])
        self.is_evaluated = True
        if skill_id != slots["skill-id"]:
            name = slots["skill-name"]
            self.scene.report(
                f"action {action} of {goal} has a skill already, and its skill {name} was called again",
                goal=goal,
                action=name,
                skill=name,
            )

    def _undo_literal(self, _template: str, slots: Mapping[str, str], *, is_true: bool) -> None:
        """Forget the executed actions with an effect that a changed fact undoes.

        :param is_true: whether the undone effect has made the atom true.
        """
        atom = (slots["name"], *parse_fields(slots["param-values"]))
        self._forget_undone({(is_true, atom)})

    def _forget_undone(self, literals: set[Literal]) -> None:
        self._achievers = {
            (operator, effects): text
            for (operator, effects), text in self._achievers.items()
            if literals.isdisjoint(effects)
        }

    def on_wait(self, key: ActionKey) -> None:
        """Forget the skill call of an action, which has a further call if the agent retries the action."""
        self._calls.pop(key, None)

    def on_start(self, tables: FactTables, action: ObservedAction) -> None:
        """Report an action whose effects were achieved and still hold."""
        effects = self._read_effects(tables, action)
        if not effects:
            return
        self.is_evaluated = True
        achiever = self._achievers.get((action.name, self._select_purpose(effects)))
        if achiever is not None:
            self.scene.report(
                f"{action.text} of {action.goal} starts, but {achiever} has been executed, "
                "and its effects still hold",
                goal=action.goal,
                action=action.text,
            )

    def on_end(self, tables: FactTables, action: ObservedAction) -> None:
        """Record the achieved effects."""
        effects = self._read_effects(tables, action)
        if effects:
            self._forget_undone({(not is_true, atom) for is_true, atom in effects})
            self._achievers[action.name, self._select_purpose(effects)] = f"{action.text} of {action.goal}"

    @staticmethod
    def _select_purpose(effects: frozenset[Literal]) -> frozenset[Literal]:
        """Return the atoms that an action makes true; without such atoms, the atoms made false.

        Thus two moves to the same place count as the same, although they start at different places.
        """
        return frozenset((is_true, atom) for is_true, atom in effects if is_true) or effects

    @staticmethod
    def _read_effects(tables: FactTables, action: ObservedAction) -> frozenset[Literal]:
        """Return the effects of an action; empty if an effect is conditional."""
        conditional_effects = {formula["part-of"] for formula in tables.printed_facts("pddl-formula")}
        effects = [
            effect for effect in tables.printed_facts("domain-effect") if effect["part-of"] == action.name
        ]
        if any(effect["name"] in conditional_effects for effect in effects):
            return frozenset()
        literals = frozenset(
            (effect["type"] == "POSITIVE", ground_predicate(effect, action.arguments)) for effect in effects
        )
        # An atom made false and true at once does not change, e.g. in a move from a place to the same place.
        return frozenset((is_true, atom) for is_true, atom in literals if (not is_true, atom) not in literals)

    def state(self) -> Hashable:
        """Return the achieved effects, and the present actions with a skill call."""
        present_keys = {
            (tables.name, slots["goal-id"], slots["plan-id"], slots["id"])
            for tables in self.scene.tables
            for slots in tables.printed_facts("plan-action")
        }
        return frozenset(self._achievers), frozenset(key for key in self._calls if key in present_keys)
