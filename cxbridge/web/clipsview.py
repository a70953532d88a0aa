"""What there is to see of a CLIPS environment."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from clips._clips import lib

from cxbridge.executive.capi import NULL, CData, decode
from cxbridge.executive.source import prepare
from cxbridge.explain.lookup import Place, short_path

if TYPE_CHECKING:
    from cxbridge.executive.environment import ClipsEnvironment


def census(env: ClipsEnvironment) -> dict[str, int]:
    """Return how many facts, rules and activations there are."""
    with env.lock:
        return {
            "facts": _count(env, lib.GetNextFact),
            "rules": _count(env, lib.GetNextDefrule),
            "agenda": _count(env, lib.GetNextActivation),
        }


def _count(env: ClipsEnvironment, following: Callable[[CData, CData], CData]) -> int:
    count, item = 0, following(env.env, NULL)
    while item != NULL:
        count, item = count + 1, following(env.env, item)
    return count


@dataclass(frozen=True, slots=True)
class RuleRow:
    """A rule.

    :param agenda: how often it is on the agenda.
    """

    name: str
    module: str
    agenda: int


def rules(env: ClipsEnvironment) -> list[RuleRow]:
    """Return all rules. To be called between runs of the rules, with the lock held."""
    waiting: Counter[str] = Counter()
    activation = lib.GetNextActivation(env.env, NULL)
    while activation != NULL:
        waiting[decode(lib.ActivationRuleName(activation))] += 1
        activation = lib.GetNextActivation(env.env, activation)
    rows = []
    rule = lib.GetNextDefrule(env.env, NULL)
    while rule != NULL:
        name = decode(lib.DefruleName(rule))
        rows.append(RuleRow(name, decode(lib.DefruleModule(rule)), waiting[name]))
        rule = lib.GetNextDefrule(env.env, rule)
    return rows


class RulePlaces:
    """Where rules are written; files are read again when they have changed. For any thread."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[int, dict[str, Place]]] = {}
        self._lock = threading.Lock()

    def of(self, files: Sequence[str]) -> dict[str, Place]:
        """Return the places of all rules in files, by name; of several the last."""
        places: dict[str, Place] = {}
        with self._lock:
            for file in dict.fromkeys(files):
                places |= self._in(file)
        return places

    def _in(self, file: str) -> dict[str, Place]:
        try:
            changed = Path(file).stat().st_mtime_ns
            if file not in self._files or self._files[file][0] != changed:
                text = Path(file).read_bytes().decode("utf-8", "surrogateescape")
                self._files[file] = (
                    changed,
                    {
                        construct.name.rpartition("::")[2]: Place(short_path(file), construct.line)
                        for construct in prepare(text, rewrite_modify=False).constructs
                        if construct.kind == "defrule"
                    },
                )
        except OSError:
            return {}
        return self._files[file][1]
