"""The slots of goals, read from the deftemplate in the core's ``goal.clp``.

Printers, recordings and servers of goals use them, so that slots are declared once.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NamedTuple

DECLARATION_FILE: Final = Path(__file__).parent.parent / "executive" / "clips" / "cx" / "goal.clp"
"""The file of the core with the deftemplate ``goal``."""

_COMMENT: Final = re.compile(r";[^\n]*")
_SLOT_DECLARATION: Final = re.compile(r"\((multi)?slot\s+([\w-]+)((?:\s*\([^()]*\))*)\s*\)")
_ATTRIBUTE: Final = re.compile(r"\(([\w-]+)\s*([^()]*)\)")
_DEFAULT_BY_TYPE: Final = {"STRING": '""', "INTEGER": "0", "FLOAT": "0.0"}


class GoalSlot(NamedTuple):
    """A slot of goals.

    :param is_multi: whether it is a multislot.
    :param type: ``SYMBOL``, ``STRING``, ``INTEGER`` or ``FLOAT``; empty if any value is allowed.
    :param default: as CLIPS prints it; empty for an empty multislot.
    """

    name: str
    is_multi: bool
    type: str
    default: str


def read_slots(text: str) -> tuple[GoalSlot, ...]:
    """Return the slots of the first deftemplate in a file, in the order of printing."""
    begin = text.index("(deftemplate")
    # up to the next construct, so that slots of other deftemplates of the file are not found; without a next
    # construct, find returns -1, which only drops the last line end
    declaration = _COMMENT.sub("", text[begin : text.find("\n(def", begin)])
    return tuple(
        _make_slot(bool(multi), name, attributes)
        for multi, name, attributes in _SLOT_DECLARATION.findall(declaration)
    )


def _make_slot(is_multi: bool, name: str, attribute_text: str) -> GoalSlot:
    """Return a slot; without ``default``, CLIPS derives the default from the allowed values or the type."""
    attributes = {key: value.strip() for key, value in _ATTRIBUTE.findall(attribute_text)}
    slot_type, allowed_values = attributes.get("type", ""), attributes.get("allowed-values", "").split()
    implicit_default = (
        "" if is_multi else allowed_values[0] if allowed_values else _DEFAULT_BY_TYPE.get(slot_type, "nil")
    )
    return GoalSlot(name, is_multi, slot_type, attributes.get("default", implicit_default))


GOAL_SLOTS: Final = read_slots(DECLARATION_FILE.read_text("utf-8"))
