"""Suggestions of known names similar to an unknown one."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import SequenceMatcher
from itertools import takewhile
from typing import Final

LIKE: Final = 0.6
"""The minimal similarity, from 0 to 1, for a suggestion."""

_MOST: Final = 3
_BY_ENDS: Final = 0.2  # the weight of equal ends, added to the similarity
_MARGIN: Final = 0.05  # names that are less similar than the nearest one by this margin are not suggested
_COMPARED: Final = 300  # comparing is slow, and hostile files may have many long names
_LONGEST: Final = 200
_SHORTEST_PART: Final = 3  # shorter names are part of too many others


def likeness(one: str, other: str) -> float:
    """Return the similarity of two names from 0 to 1, ignoring case."""
    return SequenceMatcher(None, one.lower(), other.lower()).ratio()


def nearest(name: str, known: Iterable[str], cutoff: float = LIKE) -> list[str]:
    """Return at most three known names similar to an unknown one, the nearest first.

    Case is ignored. Without similar names, the names that contain it are returned.

    :param cutoff: the minimal similarity; higher for paths, which often start equally.
    """
    names = set(known)
    if not name or not names or len(name) > _LONGEST:
        return []
    found = _similar(name, names, cutoff)
    if not found and len(name) >= _SHORTEST_PART:
        found = sorted(other for other in names if name.lower() in other.lower())
    return found[:_MOST]


def did_you_mean(name: str, known: Iterable[str], otherwise: str = "", cutoff: float = LIKE) -> str:
    """Return a hint with the likely meanings of an unknown name.

    :param otherwise: the hint if there are none.
    :param cutoff: as for :func:`nearest`.
    """
    found = nearest(name, known, cutoff)
    return f"did you mean {' or '.join(found)}?" if found else otherwise


def or_similar(name: str, known: Iterable[str]) -> str:
    """Return the hint in parentheses, `` (did you mean ...?)``, to follow a name; or empty."""
    hint = did_you_mean(name, known)
    return f" ({hint})" if hint else ""


def _similar(name: str, names: Iterable[str], cutoff: float) -> list[str]:
    def first(other: str) -> tuple[int, bool, str]:
        return abs(len(other) - len(name)), other[:1].lower() != name[:1].lower(), other

    name = name.lower()
    matcher = SequenceMatcher(None, "", name)
    scores: dict[str, float] = {}
    for other in sorted(names, key=first)[:_COMPARED]:
        matcher.set_seq1(other.lower())
        if matcher.real_quick_ratio() >= cutoff and matcher.quick_ratio() >= cutoff:
            ratio = matcher.ratio()
            if ratio >= cutoff:
                scores[other] = ratio + _BY_ENDS * _same_ends(name, other.lower())
    best = max(scores.values(), default=0.0)
    close = [other for other, score in scores.items() if score >= best - _MARGIN]
    return sorted(close, key=lambda other: (-scores[other], other))


def _same_ends(one: str, other: str) -> float:
    """Return the share of two names that is equal at their ends; typing errors are usually in one place."""
    begin = _same_beginning(one, other)
    end = _same_beginning(one[begin:][::-1], other[begin:][::-1])
    return (begin + end) / max(len(one), len(other))


def _same_beginning(one: str, other: str) -> int:
    """Return the length of the common prefix of two texts."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False)))
