"""What is known of an environment at one moment, as far as one rule is concerned: values, no pointers.

It comes from an environment (:func:`take`) or from a recording (:mod:`cxbridge.explain.recorded`), and is
all that :mod:`cxbridge.explain.diagnose` needs: the run can go on meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

from clips._clips import ffi, lib

from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.host.capi import NULL, CData, decode, encode
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.facts.copying import FactRef, FactRow, Template, template_of
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.executive.host.values import FactAddress, Value, to_python
from cxbridge.explain.lhs import Condition, called, named_globals, parse_rule, patterns
from cxbridge.explain.sexpr import read

__all__ = [
    "MAX_AGENDA",
    "MAX_FACTS",
    "QUERIES",
    "FactRef",
    "FactRow",
    "Rulebook",
    "Snapshot",
    "Template",
    "Waiting",
    "rule_texts",
    "rulebook",
    "take",
]

MAX_FACTS: Final = 50_000
"""Facts of a rule's templates that are copied; with more there are only CLIPS' own counts."""

MAX_AGENDA: Final = 1000
"""Activations that are looked at."""

_SUCCINCT: Final = 1
QUERIES: Final = ("do-for-", "delayed-do-for-", "find-fact", "find-all-facts", "any-factp", "get-fact-list")
"""How functions begin that ask for facts of any template."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """An activation on the agenda.

    :param basis: the facts, as CLIPS prints them: ``f-1,*``.
    """

    rule: str
    salience: int
    basis: str


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A rule, and what it is matched with.

    :param text: the defrule.
    :param functions: the deffunctions that its condition uses, those used by others first.
    :param global_texts: the expressions of global variables whose values are not known, in their order.
    :param agenda: the first activations, in order; None when it is not known.
    :param own_counts: what CLIPS' ``(matches RULE succinct)`` says; empty when nobody could ask.
    :param too_many: facts there are, when they were too many to copy; else 0.
    :param all_facts: whether the condition may ask for facts of any template, by a function.
    :param halted: why no rule fires any more; empty as long as they do.
    """

    env: str
    time_us: int
    text: str
    templates: Mapping[str, Template]
    facts: tuple[FactRow, ...]
    functions: tuple[str, ...] = ()
    globals: Mapping[str, Value] = field(default_factory=dict)
    global_texts: Mapping[str, str] = field(default_factory=dict)
    agenda: tuple[Waiting, ...] | None = None
    own_counts: tuple[str, ...] = ()
    too_many: int = 0
    all_facts: bool = False
    halted: str = ""

    @property
    def activations(self) -> int | None:
        """How many activations of the rule are on the agenda; None when that is not known."""
        for line in self.own_counts:
            name, _, number = line.partition(": ")
            if name == "Activations":
                return int(number)
        return None


@dataclass(frozen=True, slots=True)
class Rulebook:
    """Which rules an environment has, and what is known of those that it has not.

    :param rules: names.
    :param files: the files that were loaded, in order.
    :param diagnostics: what was wrong with them.
    :param folders: where the agent's files are, loaded or not.
    :param places: file and line of rules, where they are known without looking into the files.
    """

    rules: frozenset[str]
    files: tuple[str, ...]
    diagnostics: tuple[Diagnostic, ...] = ()
    folders: tuple[str, ...] = ()
    places: Mapping[str, tuple[str, int]] = field(default_factory=dict)


def rulebook(env: ClipsEnvironment, folders: Iterable[object] = ()) -> Rulebook:
    """Return which rules an environment has. To be called between runs of its rules."""
    names = set()
    rule = lib.GetNextDefrule(env.env, NULL)
    while rule != NULL:
        names.add(decode(lib.DefruleName(rule)))
        rule = lib.GetNextDefrule(env.env, rule)
    loader = env.loader
    return Rulebook(
        frozenset(names),
        tuple(map(str, loader.files)),
        tuple(loader.diagnostics),
        tuple(map(str, folders)),
    )


def rule_texts(env: ClipsEnvironment) -> dict[str, str]:
    """Return the defrules of an environment by name. To be called between runs of its rules."""
    texts = {}
    rule = lib.GetNextDefrule(env.env, NULL)
    while rule != NULL:
        form = lib.DefrulePPForm(rule)
        if form != NULL:
            texts[decode(lib.DefruleName(rule))] = decode(form)
        rule = lib.GetNextDefrule(env.env, rule)
    return texts


def take(env: ClipsEnvironment, rule: str, most_facts: int | None = None) -> Snapshot:
    """Copy what there is to know of a rule. To be called between runs of the rules, with the lock held.

    :param most_facts: with more, none are copied; :data:`MAX_FACTS` for None.
    :raises ClipsError: when there is no such rule.
    """
    pointer = lib.FindDefrule(env.env, encode(rule))
    if pointer == NULL:
        raise ClipsError(f"there is no rule '{rule}'")
    text = decode(lib.DefrulePPForm(pointer))
    condition = parse_rule(text)
    functions, global_names, everything = _closure(env, condition)
    names = None if everything else {pattern.template for pattern in patterns(condition.ces)}
    templates = _templates(env, names)
    limit = MAX_FACTS if most_facts is None else most_facts
    total = sum(1 for _ in _fact_pointers(env, templates, limit=limit + 1))
    facts = tuple(_facts(env, templates)) if total <= limit else ()
    return Snapshot(
        env.name,
        env.bus.clock.now_us(),
        text,
        templates,
        facts,
        functions,
        {name: _lasting(env.eval(f"?*{name}*")) for name in sorted(global_names)},
        agenda=_agenda(env),
        own_counts=_own_counts(env, pointer),
        too_many=total if total > limit else 0,
        all_facts=everything,
        halted=_halted(env),
    )


def _closure(env: ClipsEnvironment, condition: Condition) -> tuple[tuple[str, ...], frozenset[str], bool]:
    """Return deffunctions and global variables that a condition uses, and whether it may ask for any fact."""
    texts: dict[str, str] = {}
    global_names = set(condition.globals)
    everything = any(name.startswith(QUERIES) for name in condition.functions)

    def visit(names: Iterable[str]) -> None:
        nonlocal everything
        for name in sorted(names):
            function = NULL if name in texts else lib.FindDeffunction(env.env, encode(name))
            if function == NULL:
                continue
            texts[name] = ""  # it may call itself
            form = lib.DeffunctionPPForm(function)
            text = "" if form == NULL else decode(form)
            nodes = tuple(read(text))
            inner = called(nodes)
            everything = everything or any(word.startswith(QUERIES) for word in inner)
            global_names.update(named_globals(nodes))
            visit(inner)
            del texts[name]
            texts[name] = text

    try:
        visit(condition.functions)
    except RecursionError:
        raise ClipsError(f"the functions of '{condition.rule}' call one another too deep") from None
    known = {name for name in global_names if lib.FindDefglobal(env.env, encode(name)) != NULL}
    return tuple(filter(None, texts.values())), frozenset(known), everything


def _templates(env: ClipsEnvironment, names: set[str] | None) -> dict[str, Template]:
    """Return the deftemplates of these names that exist; all for None."""
    found = {}
    pointer = lib.GetNextDeftemplate(env.env, NULL)
    while pointer != NULL:
        name = decode(lib.DeftemplateName(pointer))
        if names is None or name in names:
            found[name] = template_of(pointer)
        pointer = lib.GetNextDeftemplate(env.env, pointer)
    return found


def _fact_pointers(
    env: ClipsEnvironment, templates: Mapping[str, Template], limit: int = -1
) -> Iterable[tuple[Template, CData]]:
    count = 0
    for template in templates.values():
        pointer = lib.FindDeftemplate(env.env, encode(template.name))
        fact = lib.GetNextFactInTemplate(pointer, NULL)
        while fact != NULL:
            yield template, fact
            count += 1
            if count == limit:
                return
            fact = lib.GetNextFactInTemplate(pointer, fact)


def _facts(env: ClipsEnvironment, templates: Mapping[str, Template]) -> list[FactRow]:
    """Copy the facts, in the order of their indices."""
    value = ffi.new("CLIPSValue *")
    slots = {
        name: (NULL,) if template.slots is None else tuple(encode(slot) for slot, _ in template.slots)
        for name, template in templates.items()
    }
    rows = []
    read_slot = lib.GetFactSlot
    # CLIPS has each symbol, string and number once: most values have been seen before
    seen: dict[CData, Value] = {}
    for template, fact in _fact_pointers(env, templates):
        values = []
        for slot in slots[template.name]:
            read_slot(fact, slot, value)
            pointer = value.value
            known = seen.get(pointer, seen)
            if known is seen:
                known = _lasting(to_python(value))
                if not isinstance(known, (tuple, FactRef)):
                    seen[pointer] = known
            values.append(known)
        rows.append(FactRow(int(lib.FactIndex(fact)), template.name, tuple(values)))
    return sorted(rows, key=lambda row: row.index)


def _lasting(value: Value) -> Value:
    """Return a value that is still good when the facts are gone."""
    if isinstance(value, FactAddress):
        return FactRef(int(lib.FactIndex(value.pointer)))
    return tuple(map(_lasting, value)) if isinstance(value, tuple) else value


def _agenda(env: ClipsEnvironment) -> tuple[Waiting, ...]:
    rows: list[Waiting] = []
    activation = lib.GetNextActivation(env.env, NULL)
    env.output.pause()
    while activation != NULL and len(rows) < MAX_AGENDA:
        basis = env.api.activation_text(activation).split(":", 1)[1].strip()
        rule = decode(lib.ActivationRuleName(activation))
        rows.append(Waiting(rule, int(lib.ActivationGetSalience(activation)), basis))
        activation = lib.GetNextActivation(env.env, activation)
    env.output.resume()
    return tuple(rows)


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
