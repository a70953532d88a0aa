"""Types, ids and uids of interfaces, and the patterns that select them."""

from __future__ import annotations

import re
from fnmatch import fnmatchcase
from typing import Final

from cxbridge.blackboard.errors import InvalidNameError

MAX_TYPE_LENGTH: Final = 48
"""The maximal length of a type in bytes, as in Fawkes."""

MAX_ID_LENGTH: Final = 64
"""The maximal length of an id in UTF-8 bytes, as in Fawkes."""

_TYPE = re.compile(r"[A-Za-z0-9_]+")
_WILDCARDS = "*?["


def check_names(interface_type: str, interface_id: str) -> None:
    """Check a type and an id.

    :raises InvalidNameError: if one is empty or too long, or the id contains NUL.
    """
    if not interface_type:
        raise InvalidNameError("Interface type may not be empty")
    if not interface_id:
        raise InvalidNameError("Interface ID may not be empty")
    if len(interface_type.encode()) > MAX_TYPE_LENGTH:
        raise InvalidNameError(
            f"Interface type '{interface_type}' too long, maximum length is {MAX_TYPE_LENGTH}"
        )
    if len(interface_id.encode(errors="replace")) > MAX_ID_LENGTH:
        raise InvalidNameError(f"Interface ID '{interface_id}' too long, maximum length is {MAX_ID_LENGTH}")
    if "\0" in interface_id:
        raise InvalidNameError(f"Interface ID {interface_id!r} may not contain NUL")


def parse_uid(uid: str) -> tuple[str, str]:
    """Split ``Type::id`` into type and id; the id may contain ``::``.

    :raises InvalidNameError: if the form is different, or a part is too long.
    """
    interface_type, separator, interface_id = uid.partition("::")
    if not separator or not interface_id or not _TYPE.fullmatch(interface_type):
        raise InvalidNameError(
            f"Failed to match UID {uid}, format error.", hint="write Type::id, e.g. SkillerInterface::Skiller"
        )
    check_names(interface_type, interface_id)
    return interface_type, interface_id


def matches(interface_type: str, interface_id: str, type_glob: str, id_glob: str) -> bool:
    """Return whether the shell patterns for type and id select an interface."""
    return _fits(interface_type, type_glob) and _fits(interface_id, id_glob)


def is_plain(glob: str) -> bool:
    """Return whether a shell pattern has no wildcards."""
    return not any(sign in glob for sign in _WILDCARDS)


def _fits(text: str, glob: str) -> bool:
    # most patterns are plain names, and fnmatch compiles each new pattern
    return text == glob if is_plain(glob) else fnmatchcase(text, glob)
