"""The original's feature ``plansys2``, with our planners in place of PlanSys2's nodes.

PlanSys2's problem expert keeps instances and predicates, its domain expert the domain, and its planner makes
the plan. Here the first is :class:`ProblemExpert`, the domain is what the environment parsed last, and the
planning service plans. Source: Plansys2Feature.cpp, and PlanSys2's ProblemExpert.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.environment import ClipsEnvironment
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.manager import Feature
from cxbridge.executive.planner_settings import PlannerSettings
from cxbridge.executive.values import Symbol

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain, Problem
    from cxbridge.executive.planning import PlanCall, PlannedAction, PlanningService, PlanResult, ToldCall

DomainOf = Callable[[ClipsEnvironment], "Domain | None"]


class Plansys2Feature(Feature):
    """Gives the ``psys2-*`` functions.

    :param name: what the configuration calls the feature.
    :param settings: which planner, how long.
    :param domain_of: the domain that an environment parsed last; None when it parsed none.
    :param make_service: makes the service that plans for the environment of this name; None: by planners.
    """

    def __init__(
        self,
        name: str,
        settings: PlannerSettings,
        domain_of: DomainOf,
        make_service: Callable[[str], PlanningService] | None = None,
    ) -> None:
        self.name = name
        self._settings = settings
        self._domain_of = domain_of
        self._make_service = make_service
        self._users: dict[str, _User] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define the functions and start a planner's process."""
        from cxbridge.executive.planning import PlanningService  # noqa: PLC0415 - only agents that plan pay

        settings = self._settings
        if self._make_service is not None:
            service = self._make_service(env.name)
        else:
            service = PlanningService(settings.at_once, settings.memory)
        service.warm_up()
        user = _User(env, service, settings, self._domain_of)
        self._users[env.name] = user
        env.define("psys2-add-domain-instance", user.add_instance, 2, types="*;sy;sy")
        env.define("psys2-add-domain-predicate", user.add_predicate, 1, types="*;sy")
        env.define("psys2-clear-knowledge", user.clear)
        env.define("psys2-call-planner", user.plan, 3, types="*;sy;sy;sy")

    def before_run(self, env: ClipsEnvironment) -> None:
        """Assert the plans that are ready."""
        self._users[env.name].before_run()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Cancel what is being planned and end the planners' processes."""
        self._users.pop(env.name).close()


@dataclass(slots=True)
class ProblemExpert:
    """What PlanSys2's problem expert knows: instances and predicates of a problem.

    As there, what the domain does not have is refused when it is added.
    """

    instances: dict[str, str] = field(default_factory=dict)
    predicates: dict[tuple[str, tuple[str, ...]], None] = field(default_factory=dict)

    def clear(self) -> None:
        """Forget everything."""
        self.instances.clear()
        self.predicates.clear()


@dataclass(frozen=True, slots=True)
class _Wanted:
    """A plan that was asked for."""

    goal_id: str
    plan_id: str
    formula: str


class _User:
    """An environment that plans."""

    def __init__(
        self,
        env: ClipsEnvironment,
        service: PlanningService,
        settings: PlannerSettings,
        domain_of: DomainOf,
    ) -> None:
        self._env = env
        self._service = service
        self._settings = settings
        self._domain_of = domain_of
        self._problem = ProblemExpert()
        self._log = env.bus.logger(f"PSYS2CLIPS|{env.name}")
        self._calls: list[tuple[_Wanted, PlanCall, ToldCall]] = []

    # ---- functions

    def add_instance(self, name: str, kind: str) -> None:
        from cxbridge.executive.pddl import names_of  # noqa: PLC0415

        domain = self._domain_of(self._env)
        known = set() if domain is None else {"object", *names_of(domain.types)}
        if domain is not None and str(kind) not in known:
            self._log.error(f"Problem adding instance: {name} - {kind}: the domain has no such type")
            return
        self._problem.instances[str(name)] = str(kind)

    def add_predicate(self, text: str) -> None:
        words = str(text).strip().removeprefix("(").removesuffix(")").split()
        domain = self._domain_of(self._env)
        names = set() if domain is None else {predicate.name for predicate in domain.predicates}
        if not words or (domain is not None and words[0] not in names):
            self._log.error(f"Problem adding predicate: {text}: the domain has no such predicate")
            return
        unknown = [word for word in words[1:] if word not in self._problem.instances]
        if unknown:
            missing = ", ".join(unknown)
            self._log.error(f"Problem adding predicate: {text}: there is no instance {missing}")
            return
        self._problem.predicates[words[0], tuple(words[1:])] = None

    def clear(self) -> None:
        self._problem.clear()

    def plan(self, goal_id: str, formula: str, plan_id: str) -> None:
        from cxbridge.executive.planning import PlanRequest, ToldCall  # noqa: PLC0415

        wanted = _Wanted(str(goal_id), str(plan_id), str(formula))
        settings, domain = self._settings, self._domain_of(self._env)
        domain_name = "" if domain is None else domain.name
        told = ToldCall(
            self._env.bus, self._env.name, "", wanted.goal_id, settings.planner, domain_name, wanted.formula
        )
        try:
            if domain is None:
                raise PddlError("no PDDL domain was parsed, call parse-pddl-domain first")  # noqa: TRY301
            problem = self._make_problem(domain, wanted.formula)
        except PddlError as error:
            # the original says nothing to CLIPS when its problem expert refuses a goal: the agent hangs
            self._log.error(f"Could not set the goal '{formula}' of {goal_id}: {error}")
            told.refused(str(error))
            self._feedback(wanted, "PLAN-FAILED")
            return
        request = PlanRequest(domain, problem, settings.planner, dict(settings.options), settings.timeout)
        call = self._service.call(request)
        started = told.started(Symbol(wanted.plan_id))
        if self._env.bus.clock.is_virtual:
            # as the original, which blocks: the clock stands still meanwhile
            result = call.wait()
            assert result is not None
            self._tell(wanted, result, started)
        else:
            self._calls.append((wanted, call, started))

    def _make_problem(self, domain: Domain, formula: str) -> Problem:
        from cxbridge.executive.pddl import parse_formula, problem_of_facts  # noqa: PLC0415

        expert = self._problem
        return problem_of_facts(
            domain, list(expert.instances.items()), list(expert.predicates), parse_formula(formula)
        )

    # ---- results

    def before_run(self) -> None:
        for entry in list(self._calls):
            wanted, call, told = entry
            if call.result is not None:
                self._calls.remove(entry)
                self._tell(wanted, call.result, told)

    def _tell(self, wanted: _Wanted, result: PlanResult, told: ToldCall) -> None:
        told.ended(result)
        if result.status.value != "PLANNED":
            self._log.error(
                f"Could not find plan to reach goal '{wanted.formula}' with id {wanted.goal_id}: "
                f"{result.message or result.status.value}"
            )
            self._feedback(wanted, "PLAN-FAILED")
            return
        try:
            self._assert_plan(wanted, result.actions)
        except CxbridgeError as error:
            self._log.error(f"Cannot assert the plan {wanted.plan_id}: {error}")
            self._feedback(wanted, "PLAN-FAILED")
            return
        self._feedback(wanted, "PLANNED")

    def _assert_plan(self, wanted: _Wanted, actions: tuple[PlannedAction, ...]) -> None:
        ids = {"goal-id": Symbol(wanted.goal_id)}
        self._env.assert_fact("plan", {"id": Symbol(wanted.plan_id), **ids, "type": Symbol("SEQUENTIAL")})
        for number, action in enumerate(actions, start=1):
            self._env.assert_fact(
                "plan-action",
                {
                    "id": number,
                    **ids,
                    "plan-id": Symbol(wanted.plan_id),
                    "action-name": Symbol(action.name),
                    "param-values": tuple(clips_scalar(each) for each in action.arguments),
                },
            )

    def _feedback(self, wanted: _Wanted, status: str) -> None:
        self._env.assert_fact(
            "pddl-plan-feedback", {"status": Symbol(status), "plan-id": Symbol(wanted.plan_id)}
        )

    def close(self) -> None:
        """Cancel what is being planned and end the planners' processes."""
        self._service.close()
        for _, call, told in self._calls:
            if (result := call.wait()) is not None:
                told.ended(result)
        self._calls.clear()
