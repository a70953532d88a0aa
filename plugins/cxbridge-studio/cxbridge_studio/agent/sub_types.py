"""Finds the rules that handle the sub-types of goals, and the files of the core with these rules.

The sub-type of a goal with sub-goals, such as ``RUN-ALL-OF-SUBGOALS``, is the way in which the goal runs
them. A rule handles a sub-type if its condition has a pattern for goals of the sub-type.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Final

from cxbridge.clipstext.syntax import definitions, without_module
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.condition import CE, GroupCE, PatternCE, parse_condition

SUB_TYPE_SLOT: Final = "sub-type"
NO_SUB_TYPE: Final = "nil"
"""The sub-type of a goal without sub-goals."""

# The folder of the core that has a file for each sub-type.
_SUB_TYPE_FOLDER: Final = "goals"


def find_handled_sub_types(condition: Sequence[CE]) -> frozenset[str]:
    """Return the sub-types that a rule with this condition handles.

    An ``or`` counts only if each of its branches names sub-types: another branch would match other goals,
    too.
    """
    return frozenset().union(*map(_find_handled_by_ce, condition))


def _find_handled_by_ce(ce: CE) -> frozenset[str]:
    if isinstance(ce, PatternCE):
        is_goal = without_module(ce.template) == "goal" and not ce.is_ordered
        return ce.words_by_slot.get(SUB_TYPE_SLOT, frozenset()) - {NO_SUB_TYPE} if is_goal else frozenset()
    if not isinstance(ce, GroupCE) or ce.kind not in ("and", "or", "exists"):
        return frozenset()
    branches = [_find_handled_by_ce(item) for item in ce.items]
    return frozenset().union(*branches) if ce.kind != "or" or all(branches) else frozenset()


@cache
def find_core_files(*folders: Path) -> Mapping[str, str]:
    """Return by sub-type the file of the core with the rules that handle it.

    :param folders: the folders of the core; of several files for a sub-type, that in the first folder counts.
    :returns: the files in the notation of specs: ``goals/NAME.clp``.
    """
    files: dict[str, str] = {}
    for folder in reversed(folders):
        for file in sorted((folder / _SUB_TYPE_FOLDER).glob("*.clp")):
            for definition in definitions(file.read_text("utf-8", "surrogateescape")):
                sub_types = find_handled_sub_types(parse_condition(definition.node))
                files |= dict.fromkeys(sub_types, f"{_SUB_TYPE_FOLDER}/{file.name}")
    return MappingProxyType(files)


def make_hint(sub_type: str, handled_sub_types: Collection[str], files: Mapping[str, str]) -> str:
    """Return the remedy for an unhandled sub-type: a file with its rules, or a sub-type with a similar name.

    :param handled_sub_types: the sub-types that loaded rules handle.
    :param files: the result of :func:`find_core_files`.
    :returns: empty if no file handles the sub-type and no sub-type has a similar name.
    """
    if sub_type in files:
        return f"add {files[sub_type]} to the files of the spec"
    return did_you_mean(sub_type, {*handled_sub_types, *files})
