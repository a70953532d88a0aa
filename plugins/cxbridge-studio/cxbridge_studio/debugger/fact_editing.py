"""Displays, searches and edits facts as CLIPS text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from time import perf_counter
from typing import TYPE_CHECKING, Final

from clips._clips import lib

from cxbridge.clipstext.facts import fact_text
from cxbridge.clipstext.facts import template_of as template_name
from cxbridge.daemon.operations.operation import NotFoundError
from cxbridge.errors import ClipsError
from cxbridge.executive.host.capi import NULL, decode, encode, items_of
from cxbridge.executive.host.constructs import construct_names
from cxbridge.executive.host.facts.constants import to_safe_fact_text, to_safe_values_text
from cxbridge.executive.host.facts.copying import FactTemplate, template_of
from cxbridge.executive.host.facts.modify import Modify
from cxbridge.executive.host.source import check_parser_limits
from cxbridge.executive.host.values import FactAddress, Symbol, Value
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.constructs import make_unknown_template_error

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

# CLIPS' message about a slot that the deftemplate lacks
_INVALID_SLOT: Final = re.compile(r"[Ii]nvalid slot '([^']+)'")


def read_fact_texts(env: ClipsEnvironment, template: str = "") -> Iterator[tuple[int, str]]:
    """Yield the index and the text of all facts, or of one deftemplate's facts.

    :raises ClipsError: if the deftemplate is unknown.
    """
    if template and not env.has_template(template):
        raise make_unknown_template_error(env, template)
    for index, name, slots in env.facts(template or None):
        yield index, fact_text(name, slots)


def search_facts(
    env: ClipsEnvironment, search_text: str, after: int, max_count: int, max_seconds: float
) -> tuple[list[tuple[int, str]], int | None]:
    """Search facts by text, in bounded time.

    :param search_text: a part of the text in any case; empty for all facts.
    :param after: the index up to which facts are skipped.
    :param max_count: the maximum number of results.
    :param max_seconds: the maximum duration.
    :returns: the index and the text of each fact, and the last searched index; None after the last fact.
    """
    facts: list[tuple[int, str]] = []
    deadline, last_index = perf_counter() + max_seconds, after
    for fact in items_of(lib.GetNextFact, env.c_env):
        index = int(lib.FactIndex(fact))
        if index > after:
            # Search at least one fact, so that a client that continues makes progress.
            if len(facts) >= max_count or (last_index > after and perf_counter() > deadline):
                return facts, last_index
            text = env.api.fact_text(fact)
            last_index = index
            if search_text.lower() in text.lower():
                facts.append((index, text))
    return facts, None


def assert_text(env: ClipsEnvironment, text: str, *, constants_only: bool = False) -> int:
    """Assert a fact and return its index, or the index of an equal fact.

    :param constants_only: whether only constants are accepted, not calls, which CLIPS would evaluate.
    :raises ClipsError: if CLIPS refuses the fact, or its text exceeds a limit of the parser.
    """
    text = to_safe_fact_text(env.c_env, text) if constants_only else text
    check_parser_limits(text)
    # Read the names before the assertion, which defines an unknown deftemplate of ordered facts.
    templates = construct_names(env, "deftemplate")
    outer_sink = env.output.begin_error_capture()
    fact = lib.AssertString(env.c_env, encode(text))
    errors = " ".join(env.output.end_error_capture(outer_sink).split())
    env.api.clear_halt()  # a refused fact would end the next firing of rules
    if fact == NULL or errors:
        raise ClipsError(
            f"CLIPS does not assert {text}" + (f": {errors}" if errors else ""),
            hint=_make_name_hint(env, text, errors, templates),
        )
    return int(lib.FactIndex(fact))


def _make_name_hint(env: ClipsEnvironment, text: str, errors: str, templates: Iterable[str]) -> str | None:
    """Return a hint about a wrong name of a deftemplate or a slot; None if there is no such name or no hint.

    :param text: the fact that CLIPS refuses.
    :param errors: CLIPS' messages.
    :param templates: the existing deftemplates.
    """
    template = template_name(text)
    if template not in templates:
        return did_you_mean(template, templates) or None
    invalid_slot = _INVALID_SLOT.search(errors)
    if invalid_slot is None:
        return None
    return _make_slot_hint(invalid_slot[1], template_of(lib.FindDeftemplate(env.c_env, encode(template))))


def _make_slot_hint(name: str, template: FactTemplate) -> str:
    if template.slots is None:
        return "its facts are ordered: they have no slots with names"
    return did_you_mean(name, template.names, f"it has: {', '.join(template.names)}")


def retract_fact(env: ClipsEnvironment, index: int) -> None:
    """Retract a fact.

    :raises NotFoundError: if the fact does not exist.
    """
    if not env.retract(index):
        raise NotFoundError(f"there is no fact f-{index}")


def modify_fact(
    env: ClipsEnvironment, index: int, slots: Mapping[str, str], *, constants_only: bool = False
) -> int:
    """Modify slots of a fact and return the index of the new fact.

    :param slots: values as CLIPS text: ``FINISHED``, ``"a text"``, ``a b c`` for a multislot, ``(+ 1 2)``.
    :param constants_only: whether only constants are accepted, not calls, which CLIPS would evaluate.
    :raises NotFoundError: if the fact does not exist.
    :raises ClipsError: if no slot is named, a slot does not exist, or CLIPS refuses a value.
    """
    fact = env.maker.find_fact(index)
    if fact == NULL:
        raise NotFoundError(f"there is no fact f-{index}")
    if not slots:
        raise ClipsError(f"no slot of f-{index} is named", hint="a slot and its value, e.g. (mode FINISHED)")
    deftemplate = lib.FactDeftemplate(fact)
    changes: list[Value] = []
    for slot, text in slots.items():
        if not lib.DeftemplateSlotExistP(deftemplate, encode(slot)):
            template = decode(lib.DeftemplateName(deftemplate))
            raise ClipsError(
                f"deftemplate '{template}' of f-{index} has no slot '{slot}'",
                hint=_make_slot_hint(slot, template_of(deftemplate)),
            )
        values = to_safe_values_text(text) if constants_only else text
        changes += (Symbol(slot), env.eval(f"(create$ {values})"))
    complaints: list[str] = []
    new_fact = Modify(env.c_env, env.api, env.maker, complaints.append)(index, *changes)
    env.api.clear_halt()  # a refused change would end the next firing of rules
    if not isinstance(new_fact, FactAddress):
        raise ClipsError(" ".join(complaints) or f"CLIPS refuses to modify f-{index}")
    return int(lib.FactIndex(new_fact.pointer))
