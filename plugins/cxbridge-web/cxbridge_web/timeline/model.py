"""The data of a page about a run, except its history: rules, log and interfaces, each over time.

Times and ``seq`` are those of the run's history, see :mod:`cxbridge.history.model`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cxbridge.history.builder import HistoryLimits, RunHistory
from cxbridge.history.keeping import Kept


@dataclass(frozen=True, slots=True)
class ReportLimits(HistoryLimits):
    """The limits of the data of a page; data beyond them is counted and reported.

    :param log: lines of each level: the first and the last ones.
    :param writes: writes that changed an interface, the first and the last ones.
    :param firings: firings that can be seen one by one; all are counted.
    """

    log: int = 50_000
    writes: int = 50_000
    firings: int = 100_000


@dataclass(slots=True)
class RuleCount:
    """How often a rule fired, and (seq, time) of its first and its last firing."""

    env: str
    name: str
    count: int
    first: tuple[int, int]
    last: tuple[int, int]


@dataclass(slots=True)
class InterfaceCount:
    """How often an interface was written, how often that changed anything, and when."""

    uid: str
    writes: int = 0
    changes: int = 0
    messages: int = 0
    first: int = 0
    last: int = 0


@dataclass(slots=True)
class RunModel:
    """A run as a page shows it.

    :param history: goals, plan-actions, skills and planner calls.
    :param firings: seq, time, and number of the rule in ``rules``.
    :param log: seq, time, number of the component in ``components``, text; by level.
    :param changes: seq, time, number of the interface in ``interfaces``, the fields that changed as texts.
    :param messages: seq, time, number of the interface, the message.
    :param facts: seq, time, and the difference from the number of facts at the start; empty without facts.
    :param notes: warnings for the reader, in whole sentences.
    """

    history: RunHistory
    rules: list[RuleCount] = field(default_factory=list)
    firings: Kept[tuple[int, int, int]] = field(default_factory=lambda: Kept(0))
    components: list[str] = field(default_factory=list)
    log: Mapping[str, Kept[tuple[int, int, int, str]]] = field(default_factory=dict)
    interfaces: list[InterfaceCount] = field(default_factory=list)
    changes: Kept[tuple[int, int, int, dict[str, str]]] = field(default_factory=lambda: Kept(0))
    messages: Kept[tuple[int, int, int, str]] = field(default_factory=lambda: Kept(0))
    facts: list[tuple[int, int, int]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
