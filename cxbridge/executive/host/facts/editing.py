"""Facts as people see and change them: as CLIPS text, by their indices."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from time import perf_counter
from typing import TYPE_CHECKING

from clips._clips import lib

from cxbridge.clipstext.facts import fact_text
from cxbridge.errors import ClipsError
from cxbridge.executive.host.capi import NULL, decode, encode
from cxbridge.executive.host.facts.constants import constant_fact, constant_values
from cxbridge.executive.host.facts.copying import template_of
from cxbridge.executive.host.facts.modify import Modify
from cxbridge.executive.host.source import check_excess
from cxbridge.executive.host.values import FALSE, FactAddress, Symbol, Value

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

DATA_FUNCTION = "cx-assert-data"
"""As CLIPS' `assert-string`, for text that is made of what others have sent: it takes constants only."""


def fact_texts(env: ClipsEnvironment, template: str = "") -> Iterator[tuple[int, str]]:
    """Yield index and text of all facts, or of those of a deftemplate.

    :raises ClipsError: when there is no such deftemplate.
    """
    if template and not env.has_template(template):
        raise ClipsError(f"there is no deftemplate '{template}'")
    for index, name, slots in env.facts(template or None):
        yield index, fact_text(name, slots)


def find_facts(
    env: ClipsEnvironment, words: str, after: int, most: int, seconds: float
) -> tuple[list[tuple[int, str]], int | None]:
    """Look for facts by their text, for a bounded time.

    :param words: part of the text, capital or not; empty: all facts.
    :param after: only facts with a greater index.
    :param most: so many at most.
    :param seconds: look no longer than this.
    :returns: index and text of those that were found, and the index to go on after; None when that was all.
    """
    found: list[tuple[int, str]] = []
    wanted, until = words.lower(), perf_counter() + seconds
    fact, last = lib.GetNextFact(env.env, NULL), after
    while fact != NULL:
        index = int(lib.FactIndex(fact))
        if index > after:
            if len(found) >= most or (last > after and perf_counter() > until):
                return found, last
            text = env.api.fact_text(fact)
            last = index
            if wanted in text.lower():
                found.append((index, text))
        fact = lib.GetNextFact(env.env, fact)
    return found, None


def count_facts(env: ClipsEnvironment) -> int:
    """Return how many facts there are, without a look at them."""
    fact, count = lib.GetNextFact(env.env, NULL), 0
    while fact != NULL:
        fact, count = lib.GetNextFact(env.env, fact), count + 1
    return count


def assert_text(env: ClipsEnvironment, text: str, *, constant: bool = False) -> int:
    """Assert a fact; returns its index, that of the fact which is there when it is.

    :param constant: take constants only, nothing that CLIPS evaluates.
    :raises ClipsError: when CLIPS refuses it.
    """
    text = constant_text(env, text) if constant else text
    check_excess(text)
    outer = env.output.begin_errors()
    fact = lib.AssertString(env.env, encode(text))
    said = " ".join(env.output.end_errors(outer).split())
    env.api.clear_halt()
    if fact == NULL or said:
        raise ClipsError(f"CLIPS does not assert {text}" + (f": {said}" if said else ""))
    return int(lib.FactIndex(fact))


def assert_data(env: ClipsEnvironment, text: str) -> Value:
    """Assert a fact that came as data: nothing in it is evaluated. FALSE when CLIPS refuses it.

    :raises ClipsError: when there is more than constants in it.
    """
    fact = lib.AssertString(env.env, encode(constant_text(env, text)))
    return FALSE if fact == NULL else FactAddress(fact)


def constant_text(env: ClipsEnvironment, text: str) -> str:
    """Return a fact of constants only, written by us, in which CLIPS can take nothing for a call.

    :raises ClipsError: when it is none.
    """
    fact = constant_fact(text)
    if fact.slots:
        deftemplate = lib.FindDeftemplate(env.env, encode(fact.template))
        known = () if deftemplate == NULL else [name for name, _ in template_of(deftemplate).slots or ()]
        for slot in fact.slots:
            if slot not in known:
                raise ClipsError(f"refused: there is no deftemplate '{fact.template}' with a slot '{slot}'")
    return fact.text


def retract_fact(env: ClipsEnvironment, index: int) -> None:
    """Retract a fact.

    :raises ClipsError: when there is none of that index.
    """
    if not env.retract(index):
        raise ClipsError(f"there is no fact f-{index}")


def modify_fact(
    env: ClipsEnvironment, index: int, slots: Mapping[str, str], *, constant: bool = False
) -> int:
    """Give slots of a fact other values; returns the index of the new fact.

    :param slots: by name; CLIPS text: ``FINISHED``, ``"a text"``, ``a b c`` for a multislot, ``(+ 1 2)``.
    :param constant: take constants only, nothing that CLIPS evaluates.
    :raises ClipsError: when there is no such fact or slot, or it cannot have the value.
    """
    fact = env.maker.find(index)
    if fact == NULL:
        raise ClipsError(f"there is no fact f-{index}")
    if not slots:
        raise ClipsError(f"no slot of f-{index} is named", hint="a slot and its value, e.g. (mode FINISHED)")
    deftemplate = lib.FactDeftemplate(fact)
    changes: list[Value] = []
    for slot, text in slots.items():
        if not lib.DeftemplateSlotExistP(deftemplate, encode(slot)):
            template = decode(lib.DeftemplateName(deftemplate))
            raise ClipsError(f"deftemplate '{template}' of f-{index} has no slot '{slot}'")
        values = constant_values(text) if constant else text
        changes += (Symbol(slot), env.eval(f"(create$ {values})"))
    complaints: list[str] = []
    made = Modify(env.env, env.api, env.maker, complaints.append)(index, *changes)
    env.api.clear_halt()
    if not isinstance(made, FactAddress):
        raise ClipsError(" ".join(complaints) or f"CLIPS refuses to modify f-{index}")
    return int(lib.FactIndex(made.pointer))
