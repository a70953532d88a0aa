"""Base classes of planning features.

A planning feature has :class:`PlanningFunctions` for each environment that has requested the feature: they
request plans from a planning service, and assert plans as facts.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Collection, Container, Iterable
from functools import partial
from typing import TYPE_CHECKING, Generic, TypeVar

from cxbridge.errors import PddlError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.executive.pddl import parse_formula, problem_of_facts
from cxbridge.executive.pddl.ast import Domain, Ground, Problem
from cxbridge.executive.problem.facts import INSTANCE, PREDICATE
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.call_events import PlannerCallReporter
from cxbridge_planning.faults import FAULTS, FaultyPlanning
from cxbridge_planning.service.service import PlanningService, PlanRequest
from cxbridge_planning.settings import PlannerSettings

if TYPE_CHECKING:
    from cxbridge.run.agent import Run

DomainOf = Callable[[ClipsEnvironment], Domain | None]
"""Returns the last domain parsed in an environment, or None."""

MakeService = Callable[[str], PlanningService]
"""Makes the planning service of an environment."""

KnownWorld = tuple[list[tuple[str, str]], list[Ground]]
"""Objects with their types, and facts."""

Numbers = list[tuple[Ground, float]]
"""Function values."""


def service_maker(run: Run, settings: PlannerSettings) -> MakeService:
    """Return a function that makes the planning service of an environment in a run."""
    if run.replay is not None:
        from cxbridge_planning.replay import RecordedPlanning  # noqa: PLC0415 - slow, and only for replays

        return partial(RecordedPlanning, run)
    choose_fault = run.additions.values.get(FAULTS)
    if choose_fault is not None:
        return lambda env: FaultyPlanning(choose_fault, env, run.clock.now_us)
    return lambda _env: PlanningService(settings.at_once, settings.memory)


def make_default_service(_env: str) -> PlanningService:
    """Return a service with default settings."""
    return PlanningService()


def make_request(
    settings: PlannerSettings, domain: Domain, problem: Problem, planner: str, timeout: float = 0.0
) -> PlanRequest:
    """Return a request with the configured values.

    :param planner: replaces the configured planner.
    :param timeout: replaces the configured timeout; 0: the configured timeout.
    """
    # the configured options belong to the configured planner
    options = settings.options if planner == settings.planner else {}
    return PlanRequest(domain, problem, planner, dict(options), float(timeout) or settings.timeout)


def objects_in(env: ClipsEnvironment) -> list[tuple[str, str]]:
    """Return the objects of an environment with their types."""
    return [(str(name), str(kind)) for name, kind in env.columns(INSTANCE, "name", "type")]


def facts_in(env: ClipsEnvironment, predicates: Container[str]) -> list[Ground]:
    """Return the domain facts of some predicates."""
    return [
        (str(name), tuple(map(str, values)))
        for name, values in env.columns(PREDICATE, "name", "param-values")
        if name in predicates and isinstance(values, tuple)
    ]


class PlanningFunctions:
    """The functions of a planning feature in one environment, and their running calls.

    :param domain_of: returns the last domain parsed in the environment.
    """

    def __init__(
        self,
        env: ClipsEnvironment,
        service: PlanningService,
        settings: PlannerSettings,
        domain_of: DomainOf,
    ) -> None:
        self.env = env
        self.service = service
        self.settings = settings
        self._domain_of = domain_of

    @property
    def domain(self) -> Domain | None:
        """The last domain parsed in the environment."""
        return self._domain_of(self.env)

    @abstractmethod
    def known_world(self, domain: Domain) -> KnownWorld:
        """Return the objects and facts of a problem's initial state."""

    def numbers(self, domain: Domain) -> Numbers:  # noqa: ARG002  for subclasses with functions
        """Return the function values of a problem's initial state."""
        return []

    def initial_state(self, domain: Domain, objects: Collection[str] | None) -> tuple[KnownWorld, Numbers]:
        """Return the initial state of a problem, with some of the objects and all constants.

        :param objects: the names of the objects; None: all objects.
        """
        (typed_objects, facts), numbers = self.known_world(domain), self.numbers(domain)
        if objects is None:
            return (typed_objects, facts), numbers
        # the problem's check would refuse facts about objects that the problem lacks
        names = {*objects, *(name for group in domain.constants for name in group.names)}
        return (
            [pair for pair in typed_objects if pair[0] in names],
            [fact for fact in facts if names.issuperset(fact[1])],
        ), [number for number in numbers if names.issuperset(number[0][1])]

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
        objects: Collection[str] | None = None,
    ) -> tuple[PlanRequest, PlannerCallReporter]:
        """Return a planning request, and the reporter of the call.

        :param planner: the name of the planner, by default that of the settings.
        :param timeout: the timeout in seconds; 0: the timeout of the settings.
        :param objects: the names of the problem's objects, by default all objects.
        :raises PddlError: without a domain, or if the formula does not suit the domain. The reason is
            also reported as an event.
        """
        domain, settings = self.domain, self.settings
        name = planner or settings.planner
        domain_name = "" if domain is None else domain.name
        reporter = PlannerCallReporter(self.env.bus, self.env.name, "", goal_id, name, domain_name, formula)
        try:
            if domain is None:
                raise PddlError("no PDDL domain was parsed, call parse-pddl-domain first")  # noqa: TRY301
            known_world, numbers = self.initial_state(domain, objects)
            problem = problem_of_facts(domain, *known_world, parse_formula(formula), numbers=numbers)
        except PddlError as error:
            reporter.report_refusal(str(error))
            raise
        return make_request(settings, domain, problem, name, timeout), reporter

    def assert_plan(
        self, plan_id: Symbol, goal_id: Symbol, actions: Iterable[PlannedAction], *, timed: bool = False
    ) -> None:
        """Assert a plan and its actions.

        :param timed: whether the actions have dispatch times and durations, as in a temporal plan.
        :raises CxbridgeError: if CLIPS refuses a fact.
        """
        kind = Symbol("TEMPORAL" if timed else "SEQUENTIAL")
        self.env.assert_fact("plan", {"id": plan_id, "goal-id": goal_id, "type": kind})
        for number, action in enumerate(actions, start=1):
            times: dict[str, Value] = {}
            if timed and action.start is not None:
                times = {"dispatch-time": action.start, "duration": action.duration or 0.0}
            slots = {
                "id": number,
                "plan-id": plan_id,
                "goal-id": goal_id,
                "action-name": Symbol(action.name),
                "param-values": tuple(clips_scalar(argument) for argument in action.arguments),
            }
            self.env.assert_fact("plan-action", {**slots, **times})


FunctionsT = TypeVar("FunctionsT", bound=PlanningFunctions)


class PlanningFeature(Feature, Generic[FunctionsT]):
    """A feature with a planning service per environment.

    :param domain_of: returns the last domain parsed in an environment.
    :param make_service: makes the service of an environment.
    """

    def __init__(
        self, settings: PlannerSettings, domain_of: DomainOf, make_service: MakeService = make_default_service
    ) -> None:
        self.settings = settings
        self._domain_of = domain_of
        self.make_service = make_service
        self._functions: dict[str, FunctionsT] = {}

    @abstractmethod
    def make_functions(
        self, env: ClipsEnvironment, service: PlanningService, settings: PlannerSettings, domain_of: DomainOf
    ) -> FunctionsT:
        """Define the functions in an environment, and return them."""

    def make_request(self, domain: Domain, problem: Problem) -> PlanRequest:
        """Return a request of a client that is not a rule."""
        return make_request(self.settings, domain, problem, self.settings.planner)

    def init_context(self, env: ClipsEnvironment) -> None:
        service = self.make_service(env.name)
        service.warm_up()
        self._functions[env.name] = self.make_functions(env, service, self.settings, self._domain_of)

    def before_run(self, env: ClipsEnvironment) -> None:
        self._functions[env.name].before_run()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        self._functions.pop(env.name).close()
