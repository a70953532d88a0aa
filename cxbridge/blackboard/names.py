"""Types, ids and uids of interfaces, and the patterns that select them."""

from __future__ import annotations

import re
from fnmatch import fnmatchcase
from typing import Final

from cxbridge.blackboard.errors import InvalidNameError

MAX_TYPE_LENGTH: Final = 48
"""The maximum length of a type in bytes, as in Fawkes."""

MAX_ID_LENGTH: Final = 64
"""The maximum length of an id in UTF-8 bytes, as in Fawkes."""

_TYPE = re.compile(r"[A-Za-z0-9_]+")
_WILDCARDS = "*?["


def check_names(interface_type: str, interface_id: str) -> None:
    """Check a type and an id.

    :raises InvalidNameError: if the type or the id is empty or too long, or the id contains NUL, which ends
        a name in Fawkes' messages.
    """
    if not interface_type:
        raise InvalidNameError("Interface type may not be empty")
    if not interface_id:
        raise InvalidNameError("Interface ID may not be empty")
    if len(interface_type.encode()) > MAX_TYPE_LENGTH:
        raise InvalidNameError(
            f"Interface type '{interface_type}' too long, maximum length is {MAX_TYPE_LENGTH}"
        )
    # "replace", because an id from a command line may have bytes that are not UTF-8, as lone surrogates
    if len(interface_id.encode(errors="replace")) > MAX_ID_LENGTH:
        raise InvalidNameError(f"Interface ID '{interface_id}' too long, maximum length is {MAX_ID_LENGTH}")
    if "\0" in interface_id:
        raise InvalidNameError(f"Interface ID {interface_id!r} may not contain NUL")


def parse_uid(uid: str) -> tuple[str, str]:
    """Split ``Type::id`` into type and id; the id may contain ``::``.

    :raises InvalidNameError: if the text has another form, or :func:`check_names` refuses the type or the id.
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
    return _matches_glob(interface_type, type_glob) and _matches_glob(interface_id, id_glob)


def _matches_glob(name: str, glob: str) -> bool:
    # most patterns are literal names, and fnmatch compiles each new pattern
    is_literal = not any(wildcard in glob for wildcard in _WILDCARDS)
    return name == glob if is_literal else fnmatchcase(name, glob)
