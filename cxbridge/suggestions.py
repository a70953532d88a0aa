"""Suggestions of known names that are similar to an unknown name."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import SequenceMatcher, get_close_matches
from typing import Final

MIN_LIKENESS: Final = 0.6
"""The minimum similarity, from 0 to 1, for a suggestion: the default of difflib."""

_MAX_SUGGESTIONS: Final = 3  # the default of difflib, too
_MARGIN: Final = 0.05  # below the similarity of the nearest name: less similar names are not suggested
_MAX_COMPARED: Final = 300  # comparing is slow, and hostile files may have many long names
_MAX_LENGTH: Final = 200  # comparing longer texts takes too long
_MIN_PART_LENGTH: Final = 3  # a shorter unknown name is part of too many known names


def likeness(name: str, other_name: str) -> float:
    """Return the similarity of two names from 0 to 1, ignoring case."""
    return SequenceMatcher(None, name.lower(), other_name.lower()).ratio()


def nearest_names(name: str, known_names: Iterable[str], cutoff: float = MIN_LIKENESS) -> list[str]:
    """Return at most three known names similar to an unknown name, the nearest first.

    Case is ignored. Without similar names, the names that contain the unknown name are returned in the order
    of the alphabet. A name that is too long has no similar names.

    :param cutoff: the minimum similarity; higher for paths, which often start equally.
    """
    if len(name) > _MAX_LENGTH:
        return []
    names_by_lower_case = {known.lower(): known for known in sorted(set(known_names))}
    name = name.lower()
    candidates_by_length = sorted(names_by_lower_case, key=lambda candidate: abs(len(candidate) - len(name)))
    similar = get_close_matches(name, candidates_by_length[:_MAX_COMPARED], _MAX_SUGGESTIONS, cutoff)
    if similar:
        min_likeness = likeness(similar[0], name) - _MARGIN
        similar = [candidate for candidate in similar if likeness(candidate, name) >= min_likeness]
    elif len(name) >= _MIN_PART_LENGTH:
        similar = sorted(candidate for candidate in names_by_lower_case if name in candidate)[
            :_MAX_SUGGESTIONS
        ]
    return [names_by_lower_case[candidate] for candidate in similar]


def did_you_mean(
    name: str, known_names: Iterable[str], otherwise: str = "", cutoff: float = MIN_LIKENESS
) -> str:
    """Return a hint with the likely meanings of an unknown name.

    :param otherwise: the hint if there are no similar names.
    :param cutoff: the minimum similarity, as for :func:`nearest_names`.
    """
    suggestions = nearest_names(name, known_names, cutoff)
    return f"did you mean {' or '.join(suggestions)}?" if suggestions else otherwise


def bracketed_suggestion(name: str, known_names: Iterable[str]) -> str:
    """Return the hint to follow a name, ``" (did you mean ...?)"``; empty without similar names."""
    hint = did_you_mean(name, known_names)
    return f" ({hint})" if hint else ""
