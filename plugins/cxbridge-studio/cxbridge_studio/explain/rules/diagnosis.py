"""The diagnosis of a rule: how much matches each CE, and why one matches nothing."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Count:
    """How many ways to match there are.

    :param more: whether there are more than were counted.
    """

    number: int
    more: bool = False

    def __str__(self) -> str:
        return f"{self.number}+" if self.more else str(self.number)


@dataclass(frozen=True, slots=True)
class CECount:
    """A CE and how much matches it.

    :param alone: facts that match its pattern alone; None when it is not a pattern.
    :param joined: ways in which it matches with all before it; None when one before it has none.
    """

    number: int
    text: str
    alone: Count | None
    joined: Count | None


@dataclass(frozen=True, slots=True)
class Deviation:
    """A slot in which a fact differs from a pattern.

    :param slot: its name, or ``field N``.
    :param value: the value of the fact.
    :param wanted: the constraint.
    :param known: the variables of the constraint and their values, and where they come from.
    """

    slot: str
    value: str
    wanted: str
    known: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NearMiss:
    """A fact that nearly matches.

    :param fact: index and the slots that the pattern is about.
    """

    fact: str
    deviations: tuple[Deviation, ...]


@dataclass(frozen=True, slots=True)
class MatchFailure:
    """Why a CE matches nothing.

    :param kind: ``pattern``, ``not``, ``test``, ``exists``, ``forall``, ``or`` or ``unknown``.
    :param text: the CE.
    :param reason: in a sentence.
    :param near: the facts that match the most of a pattern.
    :param facts: those that are in the way of a ``not``, or that violate a ``forall``.
    :param values: values for which a test is false.
    :param inner: why the parts of it do not match: of the branches of an ``or``, in an ``exists``.
    """

    kind: str
    text: str
    reason: str
    near: tuple[NearMiss, ...] = ()
    facts: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    inner: tuple[MatchFailure, ...] = ()


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """How a condition stands.

    :param salience: as a number, where it is known, or as source text; empty when the rule has none.
    :param elements: the CEs.
    :param failing: the number of the first CE with which nothing matches; 0 when the whole condition matches.
    :param failure: why.
    :param matches: ways in which the whole condition matches; None when it does not, or they are unknown.
    :param bases: the facts of the first of these.
    :param errors: CLIPS' messages when it evaluated the conditions.
    :param unknown: why there are no counts; empty when there are.
    """

    salience: str
    elements: tuple[CECount, ...]
    failing: int = 0
    failure: MatchFailure | None = None
    matches: Count | None = None
    bases: tuple[str, ...] = ()
    errors: tuple[str, ...] = ()
    unknown: str = ""
