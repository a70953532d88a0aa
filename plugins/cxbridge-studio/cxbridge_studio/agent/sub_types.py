"""Sub-types of goals: the rules that handle them, and the core files with these rules."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Final

from cxbridge.clipstext.syntax import definitions, without_module
from cxbridge.suggestions import nearest
from cxbridge_studio.agent.condition import CE, GroupCE, PatternCE, condition_of

SLOT: Final = "sub-type"
NONE: Final = "nil"
"""The sub-type of a goal without sub-goals."""

# The folder of the core that has a file for each sub-type.
_FOLDER: Final = "goals"


def handled(condition: Sequence[CE]) -> frozenset[str]:
    """Return the sub-types that a rule with this condition handles.

    An ``or`` counts if each of its branches names sub-types.
    """
    return frozenset().union(*map(_handled, condition))


def _handled(ce: CE) -> frozenset[str]:
    if isinstance(ce, PatternCE):
        is_goal = without_module(ce.template) == "goal" and not ce.is_ordered
        return ce.slots.get(SLOT, frozenset()) - {NONE} if is_goal else frozenset()
    if not isinstance(ce, GroupCE) or ce.kind not in ("and", "or", "exists"):
        return frozenset()
    branches = [_handled(item) for item in ce.items]
    is_sure = ce.kind != "or" or all(branches)
    return frozenset().union(*branches) if is_sure else frozenset()


@cache
def files_of_core(*folders: Path) -> Mapping[str, str]:
    """Return a core's file by sub-type, in the notation of specs.

    :param folders: the folders of the core; files in earlier folders hide those in later ones.
    """
    files: dict[str, str] = {}
    for folder in reversed(folders):
        for file in sorted((folder / _FOLDER).glob("*.clp")):
            for definition in definitions(file.read_text("utf-8", "surrogateescape")):
                name = f"{_FOLDER}/{file.name}"
                files.update(dict.fromkeys(handled(condition_of(definition.node)), name))
    return MappingProxyType(files)


def advice(sub_type: str, known: Iterable[str], files: Mapping[str, str]) -> str:
    """Return the remedy for an unhandled sub-type; empty without a similar sub-type.

    :param known: the handled sub-types.
    :param files: the result of :func:`files_of_core`.
    """
    handled_types = frozenset(known)
    if sub_type in files:
        return _add(files[sub_type])
    similar = nearest(sub_type, handled_types | files.keys())
    if not similar:
        return ""
    missing = "" if similar[0] in handled_types else f" Then {_add(files[similar[0]])}"
    return f"did you mean {' or '.join(similar)}?{missing}"


def _add(file: str) -> str:
    return f"add {file} to the files of the spec"
