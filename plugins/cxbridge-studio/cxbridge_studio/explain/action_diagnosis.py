"""Diagnoses a plan-action from the facts of one moment: why it is not executed, or why it has failed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from cxbridge.history.model import PLAN_ACTION, ActionKey
from cxbridge.history.transitions import unquote
from cxbridge.suggestions import bracketed_suggestion
from cxbridge_studio.explain.preconditions import FactLookup, Preconditions, format_atom, parse_fields

FAILED_STATES: Final = ("EXECUTION-FAILED", "FAILED")

# The templates whose facts a diagnosis reads.
ACTION_TEMPLATES: Final = (
    PLAN_ACTION,
    "plan",
    "domain-operator",
    "domain-fact",
    "pddl-formula",
    "pddl-predicate",
    "domain-pending-sensed-fact",
    "skill",
    "skill-action-execinfo",
    "skill-action-mapping",
    "skiller-control",
)


@dataclass(frozen=True, slots=True)
class ActionDiagnosis:
    """The diagnosis of an action.

    :param name: the name of the action's operator.
    :param plan_type: the type of the action's plan, such as ``SEQUENTIAL``; empty if unknown.
    :param problem: the certain reason why the action waits or has failed; may be empty.
    :param mappings: the names of the actions mapped to skills.
    :param operators: the names of the domain's operators.
    :param skiller_problem: why the Skiller cannot execute the action; may be empty.
    :param error: the text of the action's slot ``error-msg``; may be empty.
    """

    name: str
    plan_type: str
    problem: str
    mappings: tuple[str, ...]
    operators: tuple[str, ...]
    skiller_problem: str
    error: str


def diagnose_action(find_facts: FactLookup, action_key: ActionKey) -> ActionDiagnosis | None:
    """Return the diagnosis of an action, or None if the action has no fact.

    :param find_facts: finds the facts of :data:`ACTION_TEMPLATES`.
    :param action_key: the ids of the goal, the plan and the action.
    """
    goal_id, plan_id, action_id = action_key
    action = _find_fact(find_facts(PLAN_ACTION), **{"goal-id": goal_id, "plan-id": plan_id, "id": action_id})
    if not action:
        return None
    plan = _find_fact(find_facts("plan"), **{"id": plan_id, "goal-id": goal_id})
    # A failed skill comes first: after an execution, the effects of the action may make its precondition
    # false.
    problem = (
        _describe_failed_skill(find_facts, action, action_key)
        or _describe_operator_mismatch(find_facts, action)
        or _describe_missing_effects(find_facts, action, action_key)
    )
    return ActionDiagnosis(
        action.get("action-name", ""),
        plan.get("type", ""),
        problem,
        tuple(slots.get("name", "") for slots in find_facts("skill-action-mapping")),
        tuple(slots.get("name", "") for slots in find_facts("domain-operator")),
        _describe_skiller_problem(find_facts, action),
        unquote(action.get("error-msg", "")),
    )


def _find_fact(facts: Iterable[Mapping[str, str]], **values: str) -> Mapping[str, str]:
    """Return the slots of the first fact with these values; empty if there is none."""
    return next((slots for slots in facts if values.items() <= slots.items()), {})


def _describe_failed_skill(find_facts: FactLookup, action: Mapping[str, str], action_key: ActionKey) -> str:
    """Return the failure of an action's skill; empty unless the state is EXECUTION-FAILED."""
    if action.get("state") != "EXECUTION-FAILED":
        return ""
    goal_id, plan_id, action_id = action_key
    execution = _find_fact(
        find_facts("skill-action-execinfo"),
        **{"goal-id": goal_id, "plan-id": plan_id, "action-id": action_id},
    )
    skill = _find_fact(find_facts("skill"), id=execution.get("skill-id", "")) if execution else {}
    text = unquote(skill.get("skill-string", ""))
    error = unquote(action.get("error-msg", ""))
    return ": ".join(filter(None, (f"skill {text} failed" if text else "", error)))


def _describe_operator_mismatch(find_facts: FactLookup, action: Mapping[str, str]) -> str:
    """Return the mismatch of an action's operator, parameters or precondition; empty if there is none."""
    operators = {slots.get("name", ""): slots for slots in find_facts("domain-operator")}
    name = action.get("action-name", "")
    if name not in operators:
        # an agent without any operator has no domain to compare with
        return (
            f"the domain has no operator '{name}'{bracketed_suggestion(name, operators)}" if operators else ""
        )
    expected_names = parse_fields(operators[name].get("param-names", ""))
    names, values = parse_fields(action.get("param-names", "")), parse_fields(action.get("param-values", ""))
    if names and set(names) != set(expected_names):
        return (
            f"its parameters are ({' '.join(names)}), but those of the operator {name} are "
            f"({' '.join(expected_names)})"
        )
    names = names or expected_names
    if len(names) != len(values):
        return f"it has {len(values)} values for the {len(names)} parameters ({' '.join(names)})"
    # The effects of an action that has run may make its own precondition false. The slot `executable` is TRUE
    # if the executive has found the precondition true, or none to check.
    if action.get("state") == "SENSED-EFFECTS-WAIT" or action.get("executable") == "TRUE":
        return ""
    blamed_atoms = Preconditions(find_facts).describe_blame(name, dict(zip(names, values, strict=True)))
    return f"its precondition does not hold: {', '.join(blamed_atoms)}" if blamed_atoms else ""


def _describe_missing_effects(
    find_facts: FactLookup, action: Mapping[str, str], action_key: ActionKey
) -> str:
    """Return the sensed effects that an action still waits for; empty if it waits for none."""
    if action.get("state") != "SENSED-EFFECTS-WAIT":
        return ""
    effects = [
        format_atom((slots.get("name", ""), *parse_fields(slots.get("param-values", ""))))
        + (" to become false" if slots.get("type") == "NEGATIVE" else " to become true")
        for slots in find_facts("domain-pending-sensed-fact")
        if (slots.get("goal-id"), slots.get("plan-id"), slots.get("action-id")) == action_key
    ]
    return f"it waits for sensed effects, which come from rules: {', '.join(effects)}" if effects else ""


def _describe_skiller_problem(find_facts: FactLookup, action: Mapping[str, str]) -> str:
    """Return why the Skiller of an action does not execute the action; empty if it can or does."""
    skiller = unquote(action.get("skiller", ""))
    if skiller in ("", "nil"):  # any Skiller may execute the action
        return ""
    # A Skiller takes skills only from the program that has its exclusive control.
    controls = find_facts("skiller-control")
    control = next((slots for slots in controls if unquote(slots.get("skiller", "")) == skiller), None)
    if control is None:
        return f'no fact (skiller-control (skiller "{skiller}")) asks for the control of its Skiller'
    is_acquired = control.get("acquired") == "TRUE"
    return "" if is_acquired else f"the executive does not have the control of the Skiller {skiller}"
