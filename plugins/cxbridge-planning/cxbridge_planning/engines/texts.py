"""The PDDL texts for engines.

An engine gets the user's text, to which its error messages then refer. If the engine cannot read that text,
it gets a text in basic PDDL.
"""

from __future__ import annotations

import importlib
import re
from contextlib import suppress
from typing import Any, Final, NamedTuple

from msgspec.structs import replace

from cxbridge.executive.pddl import Domain, Problem, format_domain, format_problem, names_of
from cxbridge.executive.pddl.ast import ActionSchema, Formula, Quantified
from cxbridge.executive.pddl.tokens import blank_comments
from cxbridge_planning.errors import MAX_EXCERPT, PlanningError

_PROBLEM_NAME: Final = re.compile(r"(\(\s*problem\s+)[^\s()]+", re.IGNORECASE)
# the number of digits is limited, because int() refuses numbers of thousands of digits
_LINE_NUMBER: Final = re.compile(r"\bline:?\s*(\d{1,9})", re.IGNORECASE)


class PddlTexts(NamedTuple):
    """A domain and a problem as text.

    :param files: the source files of domain and problem; an empty name for a text without a file.
    """

    domain: str
    problem: str
    files: tuple[str, str] = ("", "")


def original_texts(domain: Domain, problem: Problem) -> PddlTexts:
    """Return the source texts of domain and problem; generated texts if they have no source.

    The texts have no comments, because some engines refuse non-ASCII characters in comments.
    """
    return PddlTexts(
        blank_comments(domain.text) or format_domain(domain),
        blank_comments(problem.text) or format_problem(problem),
        (domain.file if domain.text else "", problem.file if problem.text else ""),
    )


def plain_texts(domain: Domain, problem: Problem) -> PddlTexts:
    """Return texts in basic PDDL, for engines that cannot read the user's text."""
    actions = tuple(map(_merge_action_quantifiers, domain.actions))
    requirements = domain.requirements
    if domain.is_typed and "typing" not in requirements:
        requirements = (*requirements, "typing")
    return PddlTexts(
        format_domain(domain.changed(actions=actions, requirements=requirements)), format_problem(problem)
    )


def rename_problem(text: str, name: str) -> str:
    """Return a problem text with another name."""
    return _PROBLEM_NAME.sub(rf"\g<1>{name}", text, count=1)


def _merge_action_quantifiers(action: ActionSchema) -> ActionSchema:
    condition, effect = action.condition, action.effect
    return replace(
        action,
        condition=condition and condition.map(_merge_quantifiers),
        effect=effect and effect.map(_merge_quantifiers),
    )


def _merge_quantifiers(formula: Formula) -> Formula:
    """Return a formula with its directly nested quantifiers merged.

    unified-planning cannot read such quantifiers in effects.
    """
    if not isinstance(formula, Quantified) or not isinstance(formula.part, Quantified):
        return formula
    inner = formula.part
    # an inner variable that hides an outer variable must keep its scope
    hidden_names = set(names_of(formula.variables)) & set(names_of(inner.variables))
    if formula.quantifier != inner.quantifier or hidden_names:
        return formula
    return replace(formula, variables=formula.variables + inner.variables, part=inner.part)


def read_task(domain: Domain, problem: Problem) -> Any:
    """Return the problem as an object of unified-planning.

    :raises PlanningError: if parsing fails; the error names the user's file if there is one, and the line if
        it is known.
    """
    io_module = importlib.import_module("unified_planning.io")
    # PDDL permits the same name for a type, an object and a predicate
    importlib.import_module("unified_planning.shortcuts").get_environment().error_used_name = False
    user_texts = original_texts(domain, problem)
    try:
        return io_module.PDDLReader().parse_problem_string(user_texts.domain, user_texts.problem)
    except Exception as error:  # noqa: BLE001 - unified-planning raises errors of several parsers, without a common class
        parse_error = error
    basic_texts = plain_texts(domain, problem)
    with suppress(Exception):  # of two errors, the error about the user's text is raised
        return io_module.PDDLReader().parse_problem_string(basic_texts.domain, basic_texts.problem)
    raise _make_refusal_error(io_module, user_texts, parse_error) from parse_error


def _make_refusal_error(io_module: Any, texts: PddlTexts, parse_error: Exception) -> PlanningError:
    """Return the error for rejected texts; it names the domain's file unless the domain alone is readable."""
    domain_file, problem_file = texts.files
    file = domain_file
    with suppress(Exception):  # the domain is readable if there is no error
        io_module.PDDLReader().parse_problem_string(texts.domain)
        file = problem_file
    excerpt = " ".join(str(parse_error).split())[:MAX_EXCERPT] or type(parse_error).__name__
    line = getattr(parse_error, "lineno", None) or next(map(int, _LINE_NUMBER.findall(excerpt)), None)
    return PlanningError(
        f"unified-planning cannot read the problem: {excerpt}", file=file or None, line=line if file else None
    )
