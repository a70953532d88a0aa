"""The rules for names in an interface definition: Fawkes' reserved identifiers and limits."""

from __future__ import annotations

import re
from typing import Final

MAX_TYPE_LENGTH: Final = 48
"""Characters of an interface type's name at most."""

MAX_MESSAGE_LENGTH: Final = 63
"""Characters of a message type's name at most, with its suffix."""

INTERFACE_SUFFIX: Final = "Interface"
MESSAGE_SUFFIX: Final = "Message"

# fmt: off
RESERVED_IN_INTERFACES: Final = frozenset(
    {
        "id", "clone", "oftype", "datachunk", "datasize", "type", "uid", "serial", "mem_serial", "hash",
        "hash_size", "hash_printable", "writer", "validity", "valid", "owner", "from_chunk",
        "create_message", "copy_values", "enum_tostring", "resize_buffers", "num_buffers",
        "copy_shared_to_buffer", "copy_private_to_buffer", "read_from_buffer", "compare_buffers",
        "buffer_timestamp", "read", "write", "has_writer", "num_readers", "readers", "changed",
        "auto_timestamping", "timestamp", "clock", "mark_data_changed", "get_message_types",
        "msgq_enqueue", "msgq_enqueue_copy", "msgq_remove", "msgq_size", "msgq_flush", "msgq_lock",
        "msgq_try_lock", "msgq_unlock", "msgq_pop", "msgq_first", "msgq_empty", "msgq_append",
        "msgq_first_is", "msgq_first_safe", "msgq_begin", "msgq_end", "fields", "fields_end",
        "num_fields", "parse_uid", "reserved_names", "message_valid", "add_fieldinfo", "add_messageinfo",
        "data_ptr", "data_size", "data_changed", "data_ts", "type_id", "instance_serial", "mediators",
        "memory", "readwrite",
    }
)
"""What data fields, enums, enum items and constants cannot be called."""

RESERVED_IN_MESSAGES: Final = frozenset(
    {
        "id", "mark_enqueued", "enqueued", "time_enqueued", "sender_id", "sender_thread_name",
        "interface", "type", "fields", "fields_end", "num_fields", "datachunk", "datasize", "hops",
        "from_chunk", "recipient", "clone", "of_type", "as_type",
    }
)
"""What fields declared in a message cannot be called."""
# fmt: on

_IDENTIFIER = re.compile(r"(?!__)[A-Za-z_][A-Za-z0-9_]*")
_PREFIXES = {"set_": 5, "is_": 4}


def is_reserved(name: str, reserved: frozenset[str]) -> bool:
    """Return whether a name is reserved.

    Names with an accessor's prefix are compared as Fawkes does it, which drops one character too many:
    ``set_id`` may be used, ``set__id`` may not.
    """
    for prefix, dropped in _PREFIXES.items():
        if name.startswith(prefix):
            return name[dropped:] in reserved
    return name in reserved


def is_identifier(name: str) -> bool:
    """Return whether a name can be an identifier in C++ and Python; both keep ``__x`` for themselves."""
    return _IDENTIFIER.fullmatch(name) is not None


def interface_type_name(name: str) -> str:
    """Return the type's name: with the suffix unless ``Interface`` occurs in it anywhere."""
    return name if INTERFACE_SUFFIX in name else name + INTERFACE_SUFFIX


def message_type_name(name: str) -> str:
    """Return the message type's name: with the suffix unless ``Message`` occurs in it anywhere."""
    return name if MESSAGE_SUFFIX in name else name + MESSAGE_SUFFIX
