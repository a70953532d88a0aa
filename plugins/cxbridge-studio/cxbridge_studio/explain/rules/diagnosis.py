"""The diagnosis of a rule: the matches of each conditional element (CE), and the first failure to match."""

from __future__ import annotations

from dataclasses import dataclass

# The field names of these classes are keys in the JSON output of `cxbridge why`.


@dataclass(frozen=True, slots=True)
class Count:
    """A number of matches.

    :param more: whether the count ended at a limit.
    """

    number: int
    more: bool = False

    def __str__(self) -> str:
        return f"{self.number}+" if self.more else str(self.number)


@dataclass(frozen=True, slots=True)
class CECount:
    """A conditional element and its matches.

    :param alone: the number of facts that match the pattern of the CE; None if the CE is not a single
        pattern, if the pattern has variables of the CEs before it, or if the pattern cannot be matched.
    :param joined: the number of matches together with all CEs before it; None if the CEs up to this one
        cannot be matched, and after a CE without a match.
    """

    number: int
    text: str
    alone: Count | None
    joined: Count | None


@dataclass(frozen=True, slots=True)
class Deviation:
    """A slot in which a fact differs from a pattern.

    :param slot: the name of the slot, or ``field N`` of an ordered fact.
    :param value: the value of the slot in the fact.
    :param wanted: the constraint of the pattern.
    :param known: the variables in the constraint, with their values and binding CEs.
    """

    slot: str
    value: str
    wanted: str
    known: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NearMiss:
    """A fact that nearly matches.

    :param fact: the index of the fact, and its slots that the pattern constrains.
    :param deviations: the slots that do not match.
    """

    fact: str
    deviations: tuple[Deviation, ...]


@dataclass(frozen=True, slots=True)
class MatchFailure:
    """Why a conditional element has no match.

    :param kind: ``pattern``, ``not``, ``test``, ``exists``, ``forall``, ``or`` or ``unknown``.
    :param text: the conditional element.
    :param reason: the reason, in a sentence.
    :param near: the facts that match the most slots of a pattern.
    :param facts: the first facts that match a ``not`` or violate a ``forall``; for a ``not``, ``and more`` at
        the end stands for further facts.
    :param values: the values for which a ``test`` is false.
    :param inner: the failures of the branches of an ``or``.
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
    """The matches of a rule's condition at one moment, and the reason if there are none.

    :param salience: the rule's salience: a number if known, else the source text; empty without salience.
    :param elements: the conditional elements.
    :param failing: the number of the first CE that fails to match; 0 if the whole condition matches, or if
        the matches are not known.
    :param failure: why that CE has no match; None without such a CE.
    :param matches: the number of complete matches; None if there are none or they are unknown.
    :param bases: the facts of the first complete matches.
    :param errors: CLIPS' messages during matching.
    :param unknown: why the matches are not known; empty if they are.
    """

    salience: str
    elements: tuple[CECount, ...]
    failing: int = 0
    failure: MatchFailure | None = None
    matches: Count | None = None
    bases: tuple[str, ...] = ()
    errors: tuple[str, ...] = ()
    unknown: str = ""
