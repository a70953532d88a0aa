"""Base classes of planning features.

A planning feature has :class:`PlanningFunctions` for each environment that has requested the feature: they
request plans from a planning service, and assert plans as facts.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Container, Iterable
from functools import partial
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from cxbridge.errors import PddlError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.executive.pddl import parse_formula, problem_of_facts
from cxbridge.executive.pddl.ast import Domain, Ground, Problem, names_of
from cxbridge.executive.problem.facts import OBJECT_TEMPLATE, PREDICATE_TEMPLATE
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.call_events import PlannerCallReporter
from cxbridge_planning.faults import FAULTS, FaultyPlanning
from cxbridge_planning.service.service import PlanningService, PlanRequest
from cxbridge_planning.settings import PlannerSettings

if TYPE_CHECKING:
    from cxbridge.run.agent import Run

DomainOf = Callable[[ClipsEnvironment], Domain | None]
"""Returns the last domain parsed in an environment; None if none was parsed."""

MakeService = Callable[[str], PlanningService]
"""Makes the planning service of an environment."""


class KnownWorld(NamedTuple):
    """The initial state of a problem.

    :param objects: the objects, each with its type.
    :param facts: the facts that hold.
    :param numbers: the values of functions.
    """

    objects: list[tuple[str, str]]
    facts: list[Ground]
    numbers: list[tuple[Ground, float]]

    def restricted_to(self, names: Container[str]) -> KnownWorld:
        """Return the state of some objects, with the facts and numbers that are only about them."""

        def is_selected(argument: str) -> bool:
            return argument in names

        # a problem with facts about further objects would be refused
        return KnownWorld(
            [(name, type_) for name, type_ in self.objects if name in names],
            [(name, arguments) for name, arguments in self.facts if all(map(is_selected, arguments))],
            [
                ((name, arguments), value)
                for (name, arguments), value in self.numbers
                if all(map(is_selected, arguments))
            ],
        )


def service_maker(run: Run, settings: PlannerSettings) -> MakeService:
    """Return a function that makes the planning service of an environment in a run."""
    if run.replay is not None:
        from cxbridge_planning.replay import RecordedPlanning  # noqa: PLC0415 - slow, and only for replays

        return partial(RecordedPlanning, run)
    choose_fault = run.additions.values.get(FAULTS)
    if choose_fault is not None:
        return lambda env: FaultyPlanning(choose_fault, env, run.clock.now_us)
    return lambda _env: PlanningService(settings.at_once, settings.memory)


def make_request(
    settings: PlannerSettings, domain: Domain, problem: Problem, planner: str = "", timeout: float = 0.0
) -> PlanRequest:
    """Return a request with the configured values.

    :param planner: replaces the configured planner; empty: the configured planner.
    :param timeout: replaces the configured timeout; 0: the configured timeout.
    """
    # the configured options belong to the configured planner
    options = settings.options if planner in ("", settings.planner) else {}
    return PlanRequest(
        domain, problem, planner or settings.planner, options, float(timeout) or settings.timeout
    )


def objects_in(env: ClipsEnvironment) -> list[tuple[str, str]]:
    """Return the objects of an environment with their types."""
    return [(str(name), str(type_name)) for name, type_name in env.columns(OBJECT_TEMPLATE, "name", "type")]


def facts_in(env: ClipsEnvironment, domain: Domain) -> list[Ground]:
    """Return the facts of an environment that have a predicate of the domain."""
    predicates = {predicate.name for predicate in domain.predicates}
    # an agent may define the template with a single slot in place of the multislot: such facts are left out
    return [
        (str(name), tuple(map(str, values)))
        for name, values in env.columns(PREDICATE_TEMPLATE, "name", "param-values")
        if name in predicates and isinstance(values, tuple)
    ]


class PlanningFunctions(ABC):
    """The functions of a planning feature in one environment, and their running calls."""

    def __init__(self, env: ClipsEnvironment, feature: PlanningFeature) -> None:
        self.env = env
        self.settings = feature.settings
        self.service = feature.make_service(env.name)
        self.service.warm_up()
        self._domain_of = feature.domain_of

    @property
    def domain(self) -> Domain | None:
        """The last domain parsed in the environment; None if none was parsed."""
        return self._domain_of(self.env)

    @abstractmethod
    def define(self) -> None:
        """Define the functions in the environment."""

    @abstractmethod
    def known_world(self, domain: Domain) -> KnownWorld:
        """Return the initial state of a problem."""

    @abstractmethod
    def before_run(self) -> None:
        """Assert the finished plans."""

    @abstractmethod
    def close(self) -> None:
        """Cancel the running calls and stop the planner processes."""

    def request(
        self,
        goal_id: str,
        formula: str,
        planner: str = "",
        timeout: float = 0.0,
        object_names: Collection[str] | None = None,
    ) -> tuple[PlanRequest, PlannerCallReporter]:
        """Return a planning request, and the reporter of the call.

        :param planner: the name of the planner; empty: the planner of the settings.
        :param timeout: the timeout in seconds; 0: the timeout of the settings.
        :param object_names: the names of the problem's objects, by default all objects.
        :raises PddlError: without a domain, or if the formula or a fact does not suit the domain. The reason
            is also reported as an event.
        """
        domain, planner_name = self.domain, planner or self.settings.planner
        domain_name = "" if domain is None else domain.name
        reporter = PlannerCallReporter(
            self.env.bus,
            env=self.env.name,
            goal=goal_id,
            planner=planner_name,
            domain=domain_name,
            problem=formula,
        )
        try:
            if domain is None:
                raise PddlError("no PDDL domain was parsed, call parse-pddl-domain first")  # noqa: TRY301 - reported below
            world = self.known_world(domain)
            if object_names is not None:
                world = world.restricted_to({*object_names, *names_of(domain.constants)})
            goal = parse_formula(formula)
            problem = problem_of_facts(domain, world.objects, world.facts, goal, numbers=world.numbers)
        except PddlError as error:
            reporter.report_refusal(str(error))
            raise
        return make_request(self.settings, domain, problem, planner, timeout), reporter

    def assert_plan(
        self, plan_id: Symbol, goal_id: Symbol, actions: Iterable[PlannedAction], *, has_times: bool = False
    ) -> None:
        """Assert a plan and its actions.

        :param has_times: whether the actions have dispatch times and durations, as in a temporal plan.
        :raises CxbridgeError: if CLIPS refuses a fact.
        """
        kind = Symbol("TEMPORAL" if has_times else "SEQUENTIAL")
        self.env.assert_fact("plan", {"id": plan_id, "goal-id": goal_id, "type": kind})
        for number, action in enumerate(actions, start=1):
            times: dict[str, Value] = {}
            if has_times and action.start is not None:
                times = {"dispatch-time": action.start, "duration": action.duration or 0.0}
            slots = {
                "id": number,
                "plan-id": plan_id,
                "goal-id": goal_id,
                "action-name": Symbol(action.name),
                "param-values": tuple(clips_scalar(argument) for argument in action.arguments),
            }
            self.env.assert_fact("plan-action", {**slots, **times})


class PlanningFeature(Feature):
    """A feature with functions that plan, and a planning service per environment.

    :param domain_of: returns the last domain parsed in an environment.
    :param make_service: makes the service of an environment.
    :cvar functions_class: the class of the functions.
    """

    functions_class: ClassVar[type[PlanningFunctions]]

    def __init__(
        self,
        settings: PlannerSettings,
        domain_of: DomainOf,
        make_service: MakeService = lambda _env: PlanningService(),
    ) -> None:
        self.settings, self.domain_of, self.make_service = settings, domain_of, make_service
        self._functions: dict[str, PlanningFunctions] = {}

    def make_request(self, domain: Domain, problem: Problem) -> PlanRequest:
        """Return a request of a client that is not a rule."""
        return make_request(self.settings, domain, problem)

    def init_context(self, env: ClipsEnvironment) -> None:
        self._functions[env.name] = functions = self.functions_class(env, self)
        functions.define()

    def before_run(self, env: ClipsEnvironment) -> None:
        self._functions[env.name].before_run()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        self._functions.pop(env.name).close()
