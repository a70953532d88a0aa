"""Copies rules, with their facts, out of a CLIPS environment."""

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

MAX_AGENDA: Final = 1000
"""Activations that are looked at."""

_SUCCINCT: Final = 1


def rulebook(env: ClipsEnvironment, folders: Iterable[object] = ()) -> Rulebook:
    """Return which rules an environment has. To be called between runs of its rules."""
    return Rulebook(
        frozenset(name for name, _ in defrules(env)),
        tuple(map(str, env.loader.files)),
        tuple(env.loader.diagnostics),
        tuple(map(str, folders)),
    )


def fact_slots(env: ClipsEnvironment, template: str, most: int | None = None) -> list[Mapping[str, str]]:
    """Return the facts of a deftemplate: slots, as CLIPS prints their values.

    :param most: the limit of their number; None: all.
    """
    facts = islice(env.facts(template), most)
    return [{name: show(value) for name, value in slots.items()} for _, _, slots in facts]


def take(env: ClipsEnvironment, rule: str, most_facts: int | None = None) -> Snapshot:
    """Copy the evidence about a rule. To be called between runs of the rules, with the lock held.

    :param most_facts: with more, none are copied; :data:`~.snapshot.MAX_FACTS` for None.
    :raises ClipsError: when there is no such rule.
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
    """Return the text of a deffunction, empty where CLIPS has none; None when there is no such function."""
    function = lib.FindDeffunction(env.env, encode(name))
    if function == NULL:
        return None
    form = lib.DeffunctionPPForm(function)
    return "" if form == NULL else decode(form)


def _templates(env: ClipsEnvironment, names: set[str] | None) -> Mapping[str, FactTemplate]:
    """Return the deftemplates of these names that exist; all for None."""
    found = {}
    pointer = lib.GetNextDeftemplate(env.env, NULL)
    while pointer != NULL:
        name = decode(lib.DeftemplateName(pointer))
        if names is None or name in names:
            found[name] = template_of(pointer)
        pointer = lib.GetNextDeftemplate(env.env, pointer)
    return found


def _facts(env: ClipsEnvironment, templates: Iterable[str]) -> Iterator[CData]:
    """Yield the facts of deftemplates."""
    for name in templates:
        pointer = lib.FindDeftemplate(env.env, encode(name))
        fact = lib.GetNextFactInTemplate(pointer, NULL)
        while fact != NULL:
            yield fact
            fact = lib.GetNextFactInTemplate(pointer, fact)


def _lasting(value: Value) -> Value:
    """Return a value that is still good when the facts are gone."""
    if isinstance(value, FactAddress):
        return FactRef(int(lib.FactIndex(value.pointer)))
    return tuple(map(_lasting, value)) if isinstance(value, tuple) else value


def _own_counts(env: ClipsEnvironment, rule: CData) -> tuple[str, ...]:
    """Return the lines of CLIPS' own ``(matches RULE succinct)``."""
    lines: list[str] = []

    def keep(_level: Level, line: str) -> None:
        lines.append(line.strip())

    before = env.output.redirect(keep)
    try:
        lib.Matches(rule, _SUCCINCT, ffi.new("CLIPSValue *"))
    finally:
        env.output.redirect(before)
    return tuple(lines)


def _halted(env: ClipsEnvironment) -> str:
    if env.faults:
        return env.faults[0]
    if env.quit_requested:
        return "the agent has quit"
    return "the run was interrupted" if env.is_ended else ""
