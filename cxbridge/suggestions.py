"""Suggestions of known names that are similar to an unknown name."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import SequenceMatcher
from itertools import takewhile
from typing import Final

MIN_LIKENESS: Final = 0.6
"""The minimum similarity, from 0 to 1, for a suggestion."""

_MAX_SUGGESTIONS: Final = 3
_ENDS_WEIGHT: Final = 0.2  # the weight of equal starts and ends, which a typing error usually leaves
_MARGIN: Final = 0.05  # names that are less similar than the nearest name by this margin are not suggested
_MAX_COMPARED: Final = 300  # comparing is slow, and hostile files may have many long names
_MAX_LENGTH: Final = 200  # comparing longer texts takes too long
_COMMON_ENDING: Final = re.compile(r"(?<=\w)(?:\.[a-z]+|[A-Z][a-z]+)$")  # .clp, Interface
_MIN_PART_LENGTH: Final = 3  # shorter names are part of too many longer ones


def likeness(a: str, b: str) -> float:
    """Return the similarity of two names from 0 to 1, ignoring case."""
    return SequenceMatcher(None, a.lower(), b.lower()).ratio()


def nearest_names(name: str, known_names: Iterable[str], cutoff: float = MIN_LIKENESS) -> list[str]:
    """Return at most three known names similar to an unknown name, the nearest first.

    Case is ignored. Without similar names, the names that contain the unknown name are returned.

    :param cutoff: the minimum similarity; higher for paths, which often start equally.
    """
    candidates = set(known_names)
    if not name or not candidates or len(name) > _MAX_LENGTH:
        return []
    similar = _similar_names(name, candidates, cutoff)
    if not similar and len(name) >= _MIN_PART_LENGTH:
        similar = sorted(candidate for candidate in candidates if name.lower() in candidate.lower())
    return similar[:_MAX_SUGGESTIONS]


def did_you_mean(
    name: str, known_names: Iterable[str], otherwise: str = "", cutoff: float = MIN_LIKENESS
) -> str:
    """Return a hint with the likely meanings of an unknown name.

    :param otherwise: the hint if there are none.
    :param cutoff: the minimum similarity, as for :func:`nearest_names`.
    """
    suggestions = nearest_names(name, known_names, cutoff)
    return f"did you mean {' or '.join(suggestions)}?" if suggestions else otherwise


def or_similar(name: str, known_names: Iterable[str]) -> str:
    """Return the hint in parentheses, `` (did you mean ...?)``, to follow a name; or empty."""
    hint = did_you_mean(name, known_names)
    return f" ({hint})" if hint else ""


def _similar_names(name: str, candidates: Iterable[str], cutoff: float) -> list[str]:
    """Return the candidates that are about as similar as the nearest name, the nearest first."""

    def distance(candidate: str) -> tuple[int, bool, str]:
        """Return a cheap measure, which selects the candidates to compare."""
        return abs(len(candidate) - len(name)), candidate[:1].lower() != name[:1].lower(), candidate

    ending = "".join(_COMMON_ENDING.findall(name)).lower()
    name = name.lower()
    name_matcher, stem_matcher = (
        SequenceMatcher(None, "", name),
        SequenceMatcher(None, "", name.removesuffix(ending)),
    )
    scores: dict[str, float] = {}
    for candidate in sorted(candidates, key=distance)[:_MAX_COMPARED]:
        # the ending that many names have says nothing about the similarity
        matcher = stem_matcher if candidate.lower().endswith(ending) else name_matcher
        matcher.set_seq1(candidate.lower().removesuffix(ending))
        # the quick ratios are upper bounds, and most names fail them
        if matcher.real_quick_ratio() >= cutoff and matcher.quick_ratio() >= cutoff:
            ratio = matcher.ratio()
            if ratio >= cutoff:
                scores[candidate] = ratio + _ENDS_WEIGHT * _equal_ends_share(name, candidate.lower())
    best_score = max(scores.values(), default=0.0)
    close_candidates = [candidate for candidate, score in scores.items() if score >= best_score - _MARGIN]
    return sorted(close_candidates, key=lambda candidate: (-scores[candidate], candidate))


def _equal_ends_share(a: str, b: str) -> float:
    """Return the share of two names that is equal at their starts and ends."""
    prefix = _common_prefix(a, b)
    suffix = _common_prefix(a[prefix:][::-1], b[prefix:][::-1])
    return (prefix + suffix) / max(len(a), len(b))


def _common_prefix(a: str, b: str) -> int:
    """Return the length of the common prefix of two texts."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(a, b, strict=False)))
