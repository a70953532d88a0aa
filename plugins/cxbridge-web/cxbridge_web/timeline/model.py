"""The data of a page about a run besides its history: rules, log and interfaces over time.

Times and ``seq`` are those of the run's history, see :mod:`cxbridge.history.model`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cxbridge.history.builder import HistoryLimits, RunHistory
from cxbridge.history.keeping import Kept


@dataclass(frozen=True, slots=True)
class ReportLimits(HistoryLimits):
    """The limits of a page's data; data beyond them is counted and reported.

    :param log: the first and last lines of each level.
    :param writes: the first and last writes that changed an interface.
    :param firings: individually kept firings; all firings are counted.
    """

    log: int = 50_000
    writes: int = 50_000
    firings: int = 100_000


@dataclass(slots=True)
class RuleCount:
    """The number of a rule's firings, with (seq, time) of the first and the last."""

    env: str
    name: str
    count: int
    first: tuple[int, int]
    last: tuple[int, int]


@dataclass(slots=True)
class InterfaceCount:
    """The numbers and times of an interface's writes, and of those with changes."""

    uid: str
    writes: int = 0
    changes: int = 0
    messages: int = 0
    first: int = 0
    last: int = 0


@dataclass(slots=True)
class RunModel:
    """The data of a page about a run.

    :param history: goals, plan-actions, skills and planner calls.
    :param firings: seq, time, and index in ``rules``.
    :param log: by level: seq, time, index in ``components``, text.
    :param changes: seq, time, index in ``interfaces``, the changed fields as texts.
    :param messages: seq, time, index in ``interfaces``, the message.
    :param facts: seq, time, and the change of the number of facts since the start; empty without facts.
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
