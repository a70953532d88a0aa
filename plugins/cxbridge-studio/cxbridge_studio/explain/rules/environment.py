"""Copies rules and their facts from a CLIPS environment, as values that outlive the next run of the rules."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import islice, pairwise
from typing import Final

from clips._clips import ffi, lib

from cxbridge.clipstext.syntax import read_nodes
from cxbridge.clipstext.values import FactRef, Value
from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.host.capi import NULL, CData, decode, encode, items_of
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.facts.copying import FactCopier, FactTemplate, template_of
from cxbridge.executive.host.source import DUPLICATE_FUNCTION, MODIFY_FUNCTION
from cxbridge.executive.host.values import FactAddress, value_text
from cxbridge_studio.agent.condition import find_patterns
from cxbridge_studio.agent.rule import find_dependencies, parse_rule
from cxbridge_studio.constructs import iterate_rules
from cxbridge_studio.debugger.agenda import read_activations
from cxbridge_studio.explain.rules.snapshot import MAX_FACTS, Activation, Rulebook, Snapshot

MAX_AGENDA: Final = 1000  # limit of the copied activations

_SUCCINCT: Final = 1  # a macro in CLIPS' headers, which cffi does not import

# The names in the source text, by the functions that replace them when the host loads a rule.
_SOURCE_NAMES: Final = {MODIFY_FUNCTION: "modify", DUPLICATE_FUNCTION: "duplicate"}


def read_rulebook(env: ClipsEnvironment, folders: Iterable[object] = ()) -> Rulebook:
    """Return the rules of an environment. Call this between runs of its rules.

    :param folders: the folders of the agent's files.
    """
    return Rulebook(
        frozenset(name for name, _ in iterate_rules(env)),
        tuple(map(str, env.loader.files)),
        tuple(env.loader.diagnostics),
        tuple(map(str, folders)),
    )


def read_fact_slots(
    env: ClipsEnvironment, template: str, limit: int | None = None
) -> list[Mapping[str, str]]:
    """Return the slots of a deftemplate's facts, as CLIPS prints the values.

    :param limit: the maximum number of facts; None for all.
    """
    facts = islice(env.facts(template), limit)
    return [{name: value_text(value) for name, value in slots.items()} for _, _, slots in facts]


def take_snapshot(env: ClipsEnvironment, rule: str, max_facts: int = MAX_FACTS) -> Snapshot:
    """Copy a rule with its facts. Call this between runs of the rules, with the environment's lock held.

    :param max_facts: if there are more facts, none are copied.
    :raises ClipsError: if there is no such rule, or it cannot be parsed.
    """
    rule_pointer = lib.FindDefrule(env.c_env, encode(rule))
    if rule_pointer == NULL:
        raise ClipsError(f"there is no rule '{rule}'")
    text = decode(lib.DefrulePPForm(rule_pointer))
    condition = parse_rule(text)
    dependencies = find_dependencies(condition, lambda name: _read_function(env, name))
    templates = _find_templates(
        env,
        None
        if dependencies.needs_all_facts
        else {pattern.template for pattern in find_patterns(condition.ces)},
    )
    # Counting comes first: copying a fact stops the loop of a daemon for about 10 us.
    facts = list(islice(_iterate_facts(env, templates), max_facts + 1))
    copier = FactCopier(env, templates.__contains__)
    for fact in facts if len(facts) <= max_facts else ():
        copier.add(fact)
    return Snapshot(
        env.name,
        env.bus.clock.now_us(),
        text,
        templates,
        tuple(sorted(copier.copy.rows, key=lambda row: row.index)),
        dependencies.functions,
        {
            name: detach_value(env.eval(f"?*{name}*"))
            for name in sorted(dependencies.globals)
            if lib.FindDefglobal(env.c_env, encode(name)) != NULL
        },
        agenda=tuple(
            Activation(name, salience, basis)
            for salience, name, basis in islice(read_activations(env), MAX_AGENDA)
        ),
        clips_counts=_read_clips_counts(env, rule_pointer),
        uncopied_count=len(facts) if len(facts) > max_facts else 0,
        needs_all_facts=dependencies.needs_all_facts,
    )


def _read_function(env: ClipsEnvironment, name: str) -> str | None:
    """Return the text of a deffunction, empty if CLIPS keeps none; None if there is no such function."""
    function = lib.FindDeffunction(env.c_env, encode(name))
    if function == NULL:
        return None
    form = lib.DeffunctionPPForm(function)
    return "" if form == NULL else decode(form)


def _find_templates(env: ClipsEnvironment, names: set[str] | None) -> Mapping[str, FactTemplate]:
    """Return the existing deftemplates with these names, or all deftemplates for None."""
    return {
        name: template_of(pointer)
        for pointer in items_of(lib.GetNextDeftemplate, env.c_env)
        if (name := decode(lib.DeftemplateName(pointer))) and (names is None or name in names)
    }


def _iterate_facts(env: ClipsEnvironment, templates: Iterable[str]) -> Iterator[CData]:
    """Yield the pointers to the facts of deftemplates."""
    for name in templates:
        yield from items_of(lib.GetNextFactInTemplate, lib.FindDeftemplate(env.c_env, encode(name)))


def detach_value(value: Value) -> Value:
    """Return a value that stays valid after facts are retracted: the index of a fact, not its address."""
    if isinstance(value, FactAddress):
        return FactRef(int(lib.FactIndex(value.pointer)))
    return tuple(map(detach_value, value)) if isinstance(value, tuple) else value


def _read_clips_counts(env: ClipsEnvironment, rule: CData) -> tuple[str, ...]:
    """Return the output lines of CLIPS' ``(matches RULE succinct)``."""
    lines: list[str] = []

    def add_line(_level: Level, line: str) -> None:
        lines.append(line.strip())

    outer_sink = env.output.redirect(add_line)
    try:
        lib.Matches(rule, _SUCCINCT, ffi.new("CLIPSValue *"))
    finally:
        env.output.redirect(outer_sink)
    return tuple(lines)


def restore_sources(texts: Mapping[str, str]) -> dict[str, str]:
    """Return rules as their files define them, except for blanks and comments.

    :param texts: the defrules by name, as the environment prints them.
    """
    return {name: _restore_rule(text) for name, text in texts.items()}


def _restore_rule(text: str) -> str:
    """Return a rule with ``(modify F (slot V...))`` for ``(cx-modify F slot (create$ V...))``."""
    if not any(function in text for function in _SOURCE_NAMES):
        return text
    edits: list[tuple[int, int, str]] = []
    for top_list in read_nodes(text):
        for node in top_list.walk():
            if node.items and node.head in _SOURCE_NAMES:
                edits.append((node.items[0].start, node.items[0].end, _SOURCE_NAMES[node.head]))
                edits += [
                    (slot.start, value.items[0].end, f"({slot.text}")
                    for slot, value in pairwise(node.items[2:])
                    if slot.items is None and value.head == "create$" and value.items
                ]
    for start, end, replacement in sorted(edits, reverse=True):  # from the end: earlier offsets stay valid
        text = text[:start] + replacement + text[end:]
    return text
