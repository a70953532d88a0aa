"""The base of features that plan: a planning service per environment, its requests, plans as facts."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Collection, Iterable
from typing import TYPE_CHECKING, Generic, TypeVar

from cxbridge.errors import PddlError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.executive.planning.settings import PlannerSettings

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain
    from cxbridge.executive.planning import PlannedAction, PlannerCallReporter, PlanningService, PlanRequest

DomainOf = Callable[[ClipsEnvironment], "Domain | None"]
"""Returns the domain that an environment parsed last; None when it parsed none."""

MakeService = Callable[[str], "PlanningService"]
"""Makes the service that plans for the environment of this name."""

Known = tuple[list[tuple[str, str]], list[tuple[str, tuple[str, ...]]]]
"""Objects with their types, and facts: predicate and values."""

Numbers = list[tuple[tuple[str, tuple[str, ...]], float]]
"""Values of functions: function and arguments, and the value."""


class PlanningUser:
    """An environment that plans.

    :param env: the environment.
    :param service: plans for this environment only.
    :param settings: which planner, how long.
    :param domain_of: returns its domain.
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
        """The domain that the environment parsed last."""
        return self._domain_of(self.env)

    @abstractmethod
    def known(self, domain: Domain) -> Known:
        """Return the objects and facts that a problem begins with."""

    def numbers(self, domain: Domain) -> Numbers:  # noqa: ARG002 - most know none
        """Return the values of functions that a problem begins with."""
        return []

    def part(self, domain: Domain, objects: Collection[str] | None) -> tuple[Known, Numbers]:
        """Return the start of a problem with some objects only, the constants being among them.

        :param objects: None: all objects.
        """
        (known, facts), numbers = self.known(domain), self.numbers(domain)
        if objects is None:
            return (known, facts), numbers
        wanted = {*objects, *(name for group in domain.constants for name in group.names)}
        return (
            [pair for pair in known if pair[0] in wanted],
            [fact for fact in facts if wanted.issuperset(fact[1])],
        ), [number for number in numbers if wanted.issuperset(number[0][1])]

    @abstractmethod
    def before_run(self) -> None:
        """Assert the plans that are ready."""

    @abstractmethod
    def close(self) -> None:
        """Cancel the calls that still run, and end the planners' processes."""

    def request(
        self,
        goal_id: str,
        formula: str,
        planner: str = "",
        timeout: float = 0.0,
        objects: Collection[str] | None = None,
    ) -> tuple[PlanRequest, PlannerCallReporter]:
        """Return a request for a plan, and what reports the call to the bus.

        :param planner: its name; empty: that of the settings.
        :param timeout: seconds; 0: those of the settings.
        :param objects: those that the problem has; None: all.
        :raises PddlError: when there is no domain, or the formula does not fit it; the bus has the reason.
        """
        from cxbridge.executive.pddl import parse_formula, problem_of_facts  # noqa: PLC0415
        from cxbridge.executive.planning import PlannerCallReporter, PlanRequest  # noqa: PLC0415

        domain, settings = self.domain, self.settings
        name = planner or settings.planner
        domain_name = "" if domain is None else domain.name
        reporter = PlannerCallReporter(self.env.bus, self.env.name, "", goal_id, name, domain_name, formula)
        try:
            if domain is None:
                raise PddlError("no PDDL domain was parsed, call parse-pddl-domain first")  # noqa: TRY301
            known, numbers = self.part(domain, objects)
            problem = problem_of_facts(domain, *known, parse_formula(formula), numbers=numbers)
        except PddlError as error:
            reporter.refused(str(error))
            raise
        options = settings.options if name == settings.planner else {}
        return PlanRequest(domain, problem, name, dict(options), float(timeout) or settings.timeout), reporter

    def assert_plan(
        self, plan_id: Symbol, goal_id: Symbol, actions: Iterable[PlannedAction], *, timed: bool = False
    ) -> None:
        """Assert a plan, then its actions.

        :param timed: with dispatch times and durations, as a temporal plan.
        :raises CxbridgeError: when CLIPS refuses a fact.
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
                "param-values": tuple(clips_scalar(each) for each in action.arguments),
            }
            self.env.assert_fact("plan-action", {**slots, **times})


UserT = TypeVar("UserT", bound=PlanningUser)


class PlanningFeature(Feature, Generic[UserT]):
    """A feature that gives each environment a planning service.

    :param settings: which planner, how long.
    :param domain_of: returns the domain that an environment parsed last.
    :param make_service: makes the service that plans for an environment; None: by planners.
    """

    def __init__(
        self, settings: PlannerSettings, domain_of: DomainOf, make_service: MakeService | None = None
    ) -> None:
        self._settings = settings
        self._domain_of = domain_of
        self._make_service = make_service or self._planners
        self._users: dict[str, UserT] = {}

    def _planners(self, _environment: str) -> PlanningService:
        from cxbridge.executive.planning import PlanningService  # noqa: PLC0415 - only agents that plan pay

        return PlanningService(self._settings.at_once, self._settings.memory)

    @abstractmethod
    def make_user(
        self, env: ClipsEnvironment, service: PlanningService, settings: PlannerSettings, domain_of: DomainOf
    ) -> UserT:
        """Return what plans for an environment, with its functions defined."""

    def init_context(self, env: ClipsEnvironment) -> None:
        """Start a planner's process and define the functions."""
        service = self._make_service(env.name)
        service.warm_up()
        self._users[env.name] = self.make_user(env, service, self._settings, self._domain_of)

    def before_run(self, env: ClipsEnvironment) -> None:
        """Assert the plans that are ready."""
        self._users[env.name].before_run()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Cancel the calls that still run, and end the planners' processes."""
        self._users.pop(env.name).close()
