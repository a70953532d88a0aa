"""The component ``clips-executive``: goals, plans and the domain."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from functools import partial
from typing import Annotated, Any, Final, TypeVar, cast, get_origin

import msgspec
from msgspec import UNSET, Meta, Struct, UnsetType

from cxbridge.clipstext.goal_slots import GOAL_SLOTS, GoalSlot
from cxbridge.executive.host.facts.copying import FactCopy
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint
from cxbridge_web.fawkes import formulas
from cxbridge_web.fawkes.formulas import GroundedFormula, GroundedPredicate, PDDLGrounding
from cxbridge_web.fawkes.slots import ENVIRONMENT, SlotError, Slots, copy, facts, read, text
from cxbridge_web.models import Model
from cxbridge_web.paging import ListPart

_M = TypeVar("_M", bound=Model)

COMPONENT: Final = "ClipsExecutiveRestApi"  # log component of Fawkes' plugin


# The slots of goals in Fawkes' API, which all cores have.
_FAWKES_SLOTS: Final = frozenset(
    {
        *("id", "type", "sub-type", "class", "mode", "outcome", "error", "message", "parent", "priority"),
        *("params", "meta", "required-resources", "acquired-resources"),
    }
)


_TYPES: Final[Mapping[str, type]] = {"INTEGER": int, "FLOAT": float}


def _goal_member(slot: GoalSlot) -> tuple[Any, ...]:
    """Return the name and the type of the member for a goal's slot, and the default of an optional member."""
    if slot.name == "params":
        return "parameters", Annotated[list[str], Meta(extra={"slot": slot.name})]
    name, kind = slot.name.replace("-", "_"), _TYPES.get(slot.type, str)
    if slot.name == "priority":
        kind = int  # as in Fawkes, although the slot has a float
    kind = list[str] if slot.is_multi else kind
    return (name, kind) if slot.name in _FAWKES_SLOTS else (name, kind | UnsetType, UNSET)


Goal: Final = cast(
    "type[Model]",
    msgspec.defstruct(
        "Goal",
        [("plans", list[str]), *map(_goal_member, GOAL_SLOTS)],
        bases=(Model,),
        namespace={"__doc__": "A goal with its plans: all slots of the deftemplate."},
        kw_only=True,
        rename="kebab",
    ),
)


class DomainOperatorParameter(Struct):
    """A parameter of an operator."""

    name: str
    type: str


class DomainOperator(Model, kw_only=True, rename="kebab"):
    """An operator of the domain."""

    name: str
    wait_sensed: bool
    parameters: list[DomainOperatorParameter]


class DomainObject(Model, kw_only=True):
    """An object of the domain."""

    name: str
    type: str


class DomainPredicate(Model, kw_only=True, rename="kebab"):
    """A predicate of the domain."""

    name: str
    sensed: bool
    param_names: list[str]
    param_types: list[str]


class DomainFact(Model, kw_only=True, rename="kebab"):
    """A fact of the domain."""

    name: str
    param_values: list[str]


class PlanAction(Model, kw_only=True, rename="kebab"):
    """An action of a plan, with its precondition if that is grounded."""

    id: int
    operator_name: Annotated[str, Meta(extra={"slot": "action-name"})]
    param_values: list[str]
    duration: float
    dispatch_time: float
    state: str
    executable: bool
    precondition: PDDLGrounding | UnsetType = UNSET
    effects: Sequence[dict[str, Any]] = ()  # always empty, as in Fawkes
    preconditions: GroundedFormula | GroundedPredicate | UnsetType = UNSET


class Plan(Model, kw_only=True, rename="kebab"):
    """A plan of a goal."""

    id: str
    goal_id: str
    cost: float
    actions: list[PlanAction]


class PDDLFormula(Model, kw_only=True, rename="kebab"):
    """A formula of PDDL."""

    id: str
    type: str
    part_of: str


class PDDLPredicate(Model, kw_only=True, rename="kebab"):
    """An atom of PDDL."""

    id: str
    part_of: str
    predicate: str
    param_names: list[str]
    param_constants: list[str]


class GroundedPDDLFormula(Model, kw_only=True, rename="kebab"):
    """Whether a formula is satisfied in a grounding."""

    id: str
    formula_id: str
    grounding: str
    is_satisfied: bool


class GroundedPDDLPredicate(Model, kw_only=True, rename="kebab"):
    """Whether an atom is satisfied in a grounding."""

    id: str
    predicate_id: str
    grounding: str
    is_satisfied: bool


def _models(call: ApiCall, noun: str, rows: Iterable[Slots], make: Callable[[Slots], _M]) -> list[_M]:
    """Return the models of facts; unreadable facts are logged and skipped, as in Fawkes."""
    models = []
    for slots in rows:
        try:
            models.append(make(slots))
        except SlotError as error:
            call.host.bus.logger(COMPONENT).warn(f"Failed to add {noun}: {error}")
    return models


# -- goals


def _plans_of_goals(call: ApiCall) -> dict[str, list[str]]:
    plans: dict[str, list[str]] = {}
    for slots in facts(call, "plan"):
        try:
            plans.setdefault(text(slots, "goal-id"), []).append(text(slots, "id"))
        except SlotError:
            continue  # as in Fawkes, a plan without a goal is skipped
    return plans


def _goal(plans: dict[str, list[str]], slots: Slots) -> Model:
    return read(Goal, slots, plans=plans.get(text(slots, "id"), []))


def _goals(call: ApiCall) -> list[Model]:
    return _models(call, "goal", facts(call, "goal"), partial(_goal, _plans_of_goals(call)))


def _one_goal(call: ApiCall) -> Model:
    goal_id = call.path["id"]
    rows = (slots for slots in facts(call, "goal") if slots.get("id") == goal_id)
    for goal in _models(call, "goal", rows, partial(_goal, _plans_of_goals(call))):
        return goal
    raise ApiError(400, f"Goal '{goal_id}' is unknown")


# -- the domain


def _operators(call: ApiCall) -> list[DomainOperator]:
    params: dict[str, list[DomainOperatorParameter]] = {}
    for slots in facts(call, "domain-operator-parameter"):
        param = DomainOperatorParameter(text(slots, "name"), text(slots, "type"))
        params.setdefault(text(slots, "operator"), []).append(param)

    def make(slots: Slots) -> DomainOperator:
        return read(DomainOperator, slots, parameters=params.get(text(slots, "name"), []))

    return _models(call, "operator", facts(call, "domain-operator"), make)


# -- plans


def _plan(actions: dict[tuple[str, str], list[PlanAction]], slots: Slots) -> Plan:
    plan_actions = actions.get((text(slots, "goal-id"), text(slots, "id")), [])
    return read(Plan, slots, actions=sorted(plan_actions, key=lambda action: action.id))


def _action(groundings: formulas.Groundings, slots: Slots) -> PlanAction:
    action = read(PlanAction, slots)
    grounding = groundings.slots.get(text(slots, "precondition"))
    if grounding is not None:
        action.precondition = read(PDDLGrounding, grounding)
        action.preconditions = formulas.tree(groundings, action.operator_name, grounding) or UNSET
    return action


def _plans(call: ApiCall) -> list[Plan]:
    groundings = formulas.Groundings.of(call)
    actions: dict[tuple[str, str], list[PlanAction]] = {}

    def add(slots: Slots) -> PlanAction:
        key, action = (text(slots, "goal-id"), text(slots, "plan-id")), _action(groundings, slots)
        actions.setdefault(key, []).append(action)
        return action

    _models(call, "plan action", facts(call, "plan-action"), add)
    plans = _models(call, "plan", facts(call, "plan"), partial(_plan, actions))
    return sorted(plans, key=lambda plan: (plan.goal_id, plan.id))


def _one_plan(call: ApiCall) -> Plan:
    goal_id, plan_id = call.path["goal_id"], call.path["id"]
    for plan in _plans(call):
        if (plan.goal_id, plan.id) == (goal_id, plan_id):
            return plan
    raise ApiError(400, f"No plan for goal '{goal_id}' with ID '{plan_id}' found")


# -- endpoints


def _listing(path: str, model: type[Model], template: str, noun: str) -> Endpoint:
    """Return an endpoint that lists the facts of a deftemplate."""

    def copy_part(call: ApiCall) -> Generator[None, None, FactCopy]:
        return copy(call, ENVIRONMENT, template.__eq__, window=call.window)

    def handler(call: ApiCall) -> Any:
        models = _models(call, noun, facts(call, template), partial(read, model))
        return models if call.window.search else ListPart(models, call.facts.total)

    summary = f"All facts of the deftemplate {template}."
    return _get(path, list[model], summary, handler, (template,), copy=copy_part)  # type: ignore[valid-type]


def _single(path: str, model: type[Model], template: str, noun: str) -> Endpoint:
    """Return an endpoint that returns a fact of a deftemplate by its slot `id`."""

    def handler(call: ApiCall) -> Model:
        fact_id = call.path["id"]
        rows = (slots for slots in facts(call, template) if slots.get("id") == fact_id)
        for first_model in _models(call, noun, rows, partial(read, model)):
            return first_model
        raise ApiError(400, f"No {noun} with ID '{fact_id}' found")

    errors = {400: f"The {noun} does not exist"}
    return _get(
        f"{path}/{{id}}", model, f"A fact of the deftemplate {template}.", handler, (template,), errors=errors
    )


def _get(
    path: str,
    reply: Any,
    summary: str,
    handler: Callable[[ApiCall], Any],
    templates: tuple[str, ...],
    **options: Any,
) -> Endpoint:
    """Return an endpoint whose handler gets copied facts of the given deftemplates."""
    options.setdefault("copy", lambda call: copy(call, ENVIRONMENT, templates.__contains__))
    return Endpoint(
        method="GET",
        path=f"/clips-executive{path}",
        handler=handler,
        summary=summary,
        reply=reply,
        paged=get_origin(reply) is list,
        **options,
    )


_GOALS: Final = ("goal", "plan")
_OPERATORS: Final = ("domain-operator", "domain-operator-parameter")
_PLANS: Final = ("plan", "plan-action", *formulas.TEMPLATES)

_PDDL: Final[Sequence[tuple[str, type[Model], str, str]]] = (
    ("/pddl-groundings", PDDLGrounding, "pddl-grounding", "grounding"),
    ("/pddl-predicates", PDDLPredicate, "pddl-predicate", "predicate"),
    ("/pddl-formulas", PDDLFormula, "pddl-formula", "formula"),
    ("/grounded-pddl-predicates", GroundedPDDLPredicate, "grounded-pddl-predicate", "grounded predicate"),
    ("/grounded-pddl-formulas", GroundedPDDLFormula, "grounded-pddl-formula", "grounded formula"),
)

# All endpoints of the component in Fawkes' order.
ENDPOINTS: Final = (
    _get("/goals", list[Goal], "All goals.", _goals, _GOALS),  # type: ignore[valid-type]  # a type that is made at run time
    _get("/goals/{id}", Goal, "A goal.", _one_goal, _GOALS, errors={400: "The goal does not exist"}),
    _get("/domain-operators", list[DomainOperator], "All operators of the domain.", _operators, _OPERATORS),
    _listing("/domain-objects", DomainObject, "domain-object", "object"),
    _listing("/domain-predicates", DomainPredicate, "domain-predicate", "predicate"),
    _listing("/domain-facts", DomainFact, "domain-fact", "fact"),
    _get("/plans", list[Plan], "All plans with their actions.", _plans, _PLANS),
    _get(
        "/plans/{goal-id}/{id}", Plan, "A plan.", _one_plan, _PLANS, errors={400: "The plan does not exist"}
    ),
    *(_listing(*row) for row in _PDDL),
    *(_single(*row) for row in _PDDL),
    # Fawkes serves a single grounded formula at this path
    _single("/grounded-pddl-groundings", *_PDDL[-1][1:]),
)
