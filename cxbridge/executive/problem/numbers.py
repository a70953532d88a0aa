"""Numbers of PDDL domains in the CX core: comparisons in conditions, and effects on numbers.

The core's rules call the functions ``domain-comparison-holds`` and ``domain-numbers-change`` of this module.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from cxbridge.errors import CxbridgeError
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Value
from cxbridge.executive.problem.facts import FUNCTION_TEMPLATE, numbers_in, set_number

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain, Formula
    from cxbridge.executive.pddl.ast import Ground

_RULES: Final = CORE_DIR / "features" / "domain-numbers.clp"
_FUNCTIONS: Final = CORE_DIR / "features" / "functions.clp"
# the templates that a core with numbers has; Fawkes' core has neither
_NEEDED_TEMPLATES: Final = ("grounded-pddl-comparison", "domain-numbers-due")


def load_functions(env: ClipsEnvironment) -> None:
    """Load the deftemplate of function values, unless the environment has it."""
    if not env.has_template(FUNCTION_TEMPLATE):
        env.load(_FUNCTIONS)


class PddlNumbers:
    """Computes with the function values of an environment.

    :param get_domain: returns the last domain parsed in the environment; None before the first one.
    :param log_error: gets the errors of numeric effects.
    """

    def __init__(
        self, env: ClipsEnvironment, get_domain: Callable[[], Domain | None], log_error: Callable[[str], None]
    ) -> None:
        self._env, self._get_domain, self._log_error = env, get_domain, log_error
        self._formulas: dict[str, Formula] = {}
        self._has_loaded_rules = False
        load_functions(env)
        env.define("domain-comparison-holds", self.holds, 3, types="*;sy;m;m")
        env.define("domain-numbers-change", self.change, 4, types="*;sy;m;m;ld")

    def load_rules(self, domain: Domain) -> None:
        """Load the core's rules for numbers once, if the domain has functions and the core has such rules."""
        if (
            domain.functions
            and not self._has_loaded_rules
            and all(map(self._env.has_template, _NEEDED_TEMPLATES))
        ):
            self._has_loaded_rules = True
            self._env.load(_RULES)

    def holds(self, text: str, names: tuple[Value, ...], values: tuple[Value, ...]) -> Value:
        """Return TRUE if a comparison holds, otherwise FALSE.

        :param text: the comparison in PDDL.
        :param names: the variables in the comparison.
        :param values: the objects of the variables.
        """
        from cxbridge.executive.pddl import parse_formula  # noqa: PLC0415  slow: most domains have no numbers
        from cxbridge.executive.problem.truth import KnownState  # noqa: PLC0415 - as above

        if text not in self._formulas:
            self._formulas[text] = parse_formula(text)
        formula, state = self._formulas[text], KnownState((), numbers_in(self._env))
        return TRUE if formula.holds(state, _bound_objects(names, values)) else FALSE

    def change(
        self, operator: str, names: tuple[Value, ...], values: tuple[Value, ...], duration: float
    ) -> None:
        """Apply the numeric effects of an action, which all refer to the values before the action.

        :param operator: the name of the action.
        :param names: the parameters of the action.
        :param values: the objects of the parameters.
        :param duration: the duration of the action in seconds.
        """
        from cxbridge.executive.pddl.ast import NumericChange  # noqa: PLC0415 - as above
        from cxbridge.executive.problem.truth import KnownState  # noqa: PLC0415

        domain = self._get_domain()
        action = next(
            (action for action in (domain.actions if domain else ()) if action.name == operator), None
        )
        if action is None or action.effect is None:
            return
        state = KnownState((), numbers_in(self._env), duration=duration)
        new_values: dict[Ground, float] = {}
        try:
            for effect in action.effect.walk():
                if isinstance(effect, NumericChange):
                    state.change_number(effect, _bound_objects(names, values), new_values)
        except CxbridgeError as error:
            self._log_error(f"The effects of action {operator} on numbers cannot be applied: {error}")
            return
        for ground, value in new_values.items():
            set_number(self._env, ground, value)


def _bound_objects(names: tuple[Value, ...], values: tuple[Value, ...]) -> dict[str, str]:
    """Return objects by variable or parameter."""
    # names and values are from facts, which rules of agents assert, too, perhaps with fewer values than names
    return dict(zip(map(str, names), map(str, values), strict=False))
