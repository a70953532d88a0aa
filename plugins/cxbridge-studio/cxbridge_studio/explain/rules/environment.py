"""Copies rules and their facts from a CLIPS environment."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from typing import Final

from clips._clips import ffi, lib

from cxbridge.clipstext.condition import patterns
from cxbridge.clipstext.values import FactRef, Value
from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.host.agenda import agenda
from cxbridge.executive.host.capi import NULL, CData, decode, encode
from cxbridge.executive.host.constructs import defrules
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.facts.copying import FactCopier, FactTemplate, template_of
from cxbridge.executive.host.values import FactAddress, show
from cxbridge_studio.agent.rule import dependencies, parse_rule
from cxbridge_studio.explain.rules import snapshot as model
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot, Waiting

MAX_AGENDA: Final = 1000  # limit of inspected activations

_SUCCINCT: Final = 1  # CLIPS' constant, a macro that cffi does not see


def rulebook(env: ClipsEnvironment, folders: Iterable[object] = ()) -> Rulebook:
    """Return the rules of an environment. Call this between runs of its rules."""
    return Rulebook(
        frozenset(name for name, _ in defrules(env)),
        tuple(map(str, env.loader.files)),
        tuple(env.loader.diagnostics),
        tuple(map(str, folders)),
    )


def fact_slots(env: ClipsEnvironment, template: str, most: int | None = None) -> list[Mapping[str, str]]:
    """Return the slots of a deftemplate's facts, as CLIPS prints the values.

    :param most: the maximum number of facts; None for all.
    """
    facts = islice(env.facts(template), most)
    return [{name: show(value) for name, value in slots.items()} for _, _, slots in facts]


def take(env: ClipsEnvironment, rule: str, most_facts: int | None = None) -> Snapshot:
    """Copy a rule with its facts. Call this between runs of the rules, with the lock held.

    :param most_facts: if there are more facts, none are copied; None for :data:`~.snapshot.MAX_FACTS`.
    :raises ClipsError: if there is no such rule.
    """
    pointer = lib.FindDefrule(env.env, encode(rule))
    if pointer == NULL:
        raise ClipsError(f"there is no rule '{rule}'")
    text = decode(lib.DefrulePPForm(pointer))
    condition = parse_rule(text)
    needs = dependencies(condition, lambda name: _function(env, name))
    known = sorted(name for name in needs.globals if lib.FindDefglobal(env.env, encode(name)) != NULL)
    names = None if needs.all_facts else {pattern.template for pattern in patterns(condition.ces)}
    templates = _templates(env, names)
    limit = model.MAX_FACTS if most_facts is None else most_facts
    total = sum(1 for _ in islice(_facts(env, templates), limit + 1))
    copier = FactCopier(env, templates.__contains__)
    if total <= limit:
        for fact in _facts(env, templates):
            copier.add(fact)
    return Snapshot(
        env.name,
        env.bus.clock.now_us(),
        text,
        templates,
        tuple(sorted(copier.copy.rows, key=lambda row: row.index)),
        needs.functions,
        {name: _lasting(env.eval(f"?*{name}*")) for name in known},
        agenda=tuple(
            Waiting(name, salience, basis) for salience, name, basis in islice(agenda(env), MAX_AGENDA)
        ),
        own_counts=_own_counts(env, pointer),
        too_many=total if total > limit else 0,
        all_facts=needs.all_facts,
        halted=_halted(env),
    )


def _function(env: ClipsEnvironment, name: str) -> str | None:
    """Return the text of a deffunction, empty if CLIPS keeps none; None if there is no such function."""
    function = lib.FindDeffunction(env.env, encode(name))
    if function == NULL:
        return None
    form = lib.DeffunctionPPForm(function)
    return "" if form == NULL else decode(form)


def _templates(env: ClipsEnvironment, names: set[str] | None) -> Mapping[str, FactTemplate]:
    """Return the existing deftemplates with these names; None for all."""
    templates = {}
    pointer = lib.GetNextDeftemplate(env.env, NULL)
    while pointer != NULL:
        name = decode(lib.DeftemplateName(pointer))
        if names is None or name in names:
            templates[name] = template_of(pointer)
        pointer = lib.GetNextDeftemplate(env.env, pointer)
    return templates


def _facts(env: ClipsEnvironment, templates: Iterable[str]) -> Iterator[CData]:
    for name in templates:
        pointer = lib.FindDeftemplate(env.env, encode(name))
        fact = lib.GetNextFactInTemplate(pointer, NULL)
        while fact != NULL:
            yield fact
            fact = lib.GetNextFactInTemplate(pointer, fact)


def _lasting(value: Value) -> Value:
    """Return a value that stays valid after facts are retracted."""
    if isinstance(value, FactAddress):
        return FactRef(int(lib.FactIndex(value.pointer)))
    return tuple(map(_lasting, value)) if isinstance(value, tuple) else value


def _own_counts(env: ClipsEnvironment, rule: CData) -> tuple[str, ...]:
    """Return the output of CLIPS' ``(matches RULE succinct)``."""
    lines: list[str] = []

    def add_line(_level: Level, line: str) -> None:
        lines.append(line.strip())

    outer_sink = env.output.redirect(add_line)
    try:
        lib.Matches(rule, _SUCCINCT, ffi.new("CLIPSValue *"))
    finally:
        env.output.redirect(outer_sink)
    return tuple(lines)


def _halted(env: ClipsEnvironment) -> str:
    if env.faults:
        return env.faults[0]
    if env.quit_requested:
        return "the agent has quit"
    return "the run was interrupted" if env.is_ended else ""
