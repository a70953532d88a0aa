"""The sub-types of goals: the rules that handle one, and the file of the core that has these rules."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Final

from cxbridge.clipstext.condition import CE, GroupCE, PatternCE, condition_of
from cxbridge.clipstext.syntax import definitions, without_module
from cxbridge.suggestions import nearest

SLOT: Final = "sub-type"
NONE: Final = "nil"
"""The sub-type of a goal without sub-goals."""

# The folder of the core that has a file for each sub-type.
_FOLDER: Final = "goals"


def handled(condition: Sequence[CE]) -> frozenset[str]:
    """Return the sub-types for which a rule with this condition is made.

    An ``or`` counts when each of its branches names sub-types.
    """
    return frozenset().union(*map(_handled, condition))


def _handled(ce: CE) -> frozenset[str]:
    if isinstance(ce, PatternCE):
        is_goal = without_module(ce.template) == "goal" and not ce.is_ordered
        return ce.slots.get(SLOT, frozenset()) - {NONE} if is_goal else frozenset()
    if not isinstance(ce, GroupCE) or ce.kind not in ("and", "or", "exists"):
        return frozenset()
    branches = [_handled(each) for each in ce.items]
    is_sure = ce.kind != "or" or all(branches)
    return frozenset().union(*branches) if is_sure else frozenset()


@cache
def files_of_core(*folders: Path) -> Mapping[str, str]:
    """Return the files for the sub-types of a core, each by the name with which a spec loads it.

    :param folders: of the core; the files of an earlier folder hide those of a later one.
    """
    found: dict[str, str] = {}
    for folder in reversed(folders):
        for file in sorted((folder / _FOLDER).glob("*.clp")):
            for each in definitions(file.read_text("utf-8", "surrogateescape")):
                name = f"{_FOLDER}/{file.name}"
                found.update(dict.fromkeys(handled(condition_of(each.node)), name))
    return MappingProxyType(found)


def advice(sub_type: str, known: Iterable[str], files: Mapping[str, str]) -> str:
    """Return how a goal gets a sub-type that rules handle; empty when the sub-type is like no known one.

    :param sub_type: which no rule handles.
    :param known: the sub-types that rules handle.
    :param files: as :func:`files_of_core` returns them.
    """
    known = frozenset(known)
    if sub_type in files:
        return _add(files[sub_type])
    meant = nearest(sub_type, known | files.keys())
    if not meant:
        return ""
    missing = "" if meant[0] in known else f" Then {_add(files[meant[0]])}"
    return f"did you mean {' or '.join(meant)}?{missing}"


def _add(file: str) -> str:
    return f"add {file} to the files of the spec"
