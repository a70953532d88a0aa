"""The feature `planner`: plans from the facts at hand, made beside the executive. See docs/planning.md."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.manager import Feature
from cxbridge.executive.planner_settings import PlannerSettings
from cxbridge.executive.values import FALSE, NIL, TRUE, Symbol, Value

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain, Problem
    from cxbridge.executive.planning import PlanCall, PlannedAction, PlanningService, PlanResult, ToldCall

_FILES = CORE_DIR / "planner"
_NEEDED_BY_GOALS = ("goal", "plan", "plan-action")


class PlannerFeature(Feature):
    """Gives ``planner-plan``, ``planner-plan-with`` and ``planner-cancel``.

    :param domain_of: the domain that an environment parsed last; None when it parsed none.
    :param make_service: makes the service that plans for the environment of this name; None: by planners.
    """

    name = "planner"

    def __init__(
        self,
        settings: PlannerSettings,
        domain_of: Callable[[ClipsEnvironment], Domain | None],
        make_service: Callable[[str], PlanningService] | None = None,
    ) -> None:
        self._make_service = make_service
        self._settings = settings
        self._domain_of = domain_of
        self._users: dict[str, _User] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define the functions and the template of calls; start a planner's process."""
        # only agents that plan pay for it
        from cxbridge.executive.planning import PlanningService  # noqa: PLC0415

        settings = self._settings
        if self._make_service is not None:
            service = self._make_service(env.name)
        else:
            service = PlanningService(settings.at_once, settings.memory)
        service.warm_up()
        user = _User(env, service, settings, self._domain_of)
        self._users[env.name] = user
        env.load(_FILES / "calls.clp")
        env.define("planner-plan", user.plan, 2, types="*;sy;sy")
        env.define("planner-plan-with", user.plan, 4, types="*;sy;sy;sy;ld")
        env.define("planner-cancel", user.cancel, 1, types="*;sy")

    def before_run(self, env: ClipsEnvironment) -> None:
        """Tell of the plans that are ready."""
        self._users[env.name].before_run()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Cancel what is being planned and end the planners' processes."""
        self._users.pop(env.name).close()


class _User:
    """An environment that plans."""

    def __init__(
        self,
        env: ClipsEnvironment,
        service: PlanningService,
        settings: PlannerSettings,
        domain_of: Callable[[ClipsEnvironment], Domain | None],
    ) -> None:
        self._env = env
        self.service = service
        self._settings = settings
        self._domain_of = domain_of
        self._log = env.bus.logger(f"Planner|{env.name}")
        self._calls: dict[str, PlanCall] = {}
        self._told: dict[str, ToldCall] = {}
        self._made = 0
        self._goals_loaded = False

    # ---- functions

    def plan(self, goal_id: str, formula: str, planner: str = "", timeout: float = 0.0) -> Value:
        from cxbridge.executive.planning import PlanRequest, ToldCall  # noqa: PLC0415

        domain = self._domain_of(self._env)
        settings = self._settings
        name = planner or settings.planner
        domain_name = "" if domain is None else domain.name
        told = ToldCall(self._env.bus, self._env.name, "", goal_id, name, domain_name, formula)
        if domain is None:
            reason = "no PDDL domain was parsed, call parse-pddl-domain first"
            self._log.error(f"Cannot plan: {reason}")
            told.refused(reason)
            return FALSE
        try:
            problem = self._problem(domain, formula)
        except PddlError as error:
            self._log.error(f"Cannot plan for {formula}: {error}")
            told.refused(str(error))
            return FALSE
        options = settings.options if name == settings.planner else {}
        request = PlanRequest(domain, problem, name, dict(options), float(timeout) or settings.timeout)
        self._made += 1
        call_id = Symbol(f"plan-{self._made}")
        self._told[call_id] = told.started(call_id)
        self._calls[call_id] = self.service.call(request)
        self._env.assert_fact(
            "planner-call", {"id": call_id, "goal-id": Symbol(goal_id), "planner": Symbol(name)}
        )
        return call_id

    def cancel(self, call_id: str) -> Value:
        call = self._calls.get(call_id)
        if call is None:
            return FALSE
        call.cancel()
        return TRUE

    def _problem(self, domain: Domain, formula: str) -> Problem:
        from cxbridge.executive.pddl import parse_formula, problem_of_facts  # noqa: PLC0415

        predicates = {predicate.name for predicate in domain.predicates}
        objects = [
            (str(slots["name"]), str(slots["type"])) for _, _, slots in self._env.facts("domain-object")
        ]
        facts = [
            (str(slots["name"]), tuple(str(value) for value in slots["param-values"]))
            for _, _, slots in self._env.facts("domain-fact")
            if slots["name"] in predicates
        ]
        return problem_of_facts(domain, objects, facts, parse_formula(formula))

    # ---- results

    def before_run(self) -> None:
        if not self._goals_loaded:
            self._load_goals()
        if not self._calls:
            return
        # a virtual clock stands still meanwhile, so that runs repeat
        waits = self._env.bus.clock.is_virtual
        for call_id, call in list(self._calls.items()):
            result = call.wait() if waits else call.result
            if result is not None:
                del self._calls[call_id]
                self._tell(call_id, result)

    def _load_goals(self) -> None:
        """Load the rules for goals as soon as there are goals and plans."""
        if all(self._env.has_template(name) for name in _NEEDED_BY_GOALS):
            self._goals_loaded = True
            self._env.load(_FILES / "goals.clp")

    def _tell(self, call_id: str, result: PlanResult) -> None:
        planned = result.status.value == "PLANNED"
        if planned:
            self._assert_plan(call_id, result.actions)
        self._told.pop(call_id).ended(result)
        text = f"{len(result.actions)} actions" if planned else result.message
        self._log.info(f"{call_id}: {result.status.value} by {result.planner}: {text}")
        self._env.call(
            "planner-call-ended",
            Symbol(call_id),
            Symbol(result.status.value),
            Symbol(result.planner),
            Symbol(call_id) if planned else NIL,
            result.message,
            result.seconds,
        )

    def close(self) -> None:
        """Cancel what is being planned and end the planners' processes."""
        self.service.close()
        for call_id, call in self._calls.items():
            if (result := call.wait()) is not None:
                self._told.pop(call_id).ended(result)

    def _assert_plan(self, call_id: str, actions: tuple[PlannedAction, ...]) -> None:
        goals = [
            slots["goal-id"] for _, _, slots in self._env.facts("planner-call") if slots["id"] == call_id
        ]
        goal_id = goals[0] if goals else NIL
        timed = any(action.start is not None for action in actions)
        try:
            self._env.assert_fact(
                "plan",
                {
                    "id": Symbol(call_id),
                    "goal-id": goal_id,
                    "type": Symbol("TEMPORAL" if timed else "SEQUENTIAL"),
                },
            )
            for number, action in enumerate(actions, start=1):
                times: dict[str, Value] = {}
                if action.start is not None:
                    times = {"dispatch-time": action.start, "duration": action.duration or 0.0}
                self._env.assert_fact(
                    "plan-action",
                    {
                        "id": number,
                        "plan-id": Symbol(call_id),
                        "goal-id": goal_id,
                        "action-name": Symbol(action.name),
                        "param-values": tuple(clips_scalar(each) for each in action.arguments),
                        **times,
                    },
                )
        except CxbridgeError as error:
            self._log.error(f"Cannot assert the plan {call_id}: {error}")
