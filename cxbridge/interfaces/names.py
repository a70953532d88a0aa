"""Rules for names in interface definitions: reserved identifiers, and limits of Fawkes."""

from __future__ import annotations

import re
from typing import Final

MAX_TYPE_LENGTH: Final = 48
"""The maximum number of characters in the name of an interface type: Fawkes' ``INTERFACE_TYPE_SIZE_``."""

# INTERFACE_MESSAGE_TYPE_SIZE_ of Fawkes without NUL
MAX_MESSAGE_LENGTH: Final = 63
"""The maximum number of characters in the name of a message type, including the suffix."""

INTERFACE_SUFFIX: Final = "Interface"
MESSAGE_SUFFIX: Final = "Message"

# The lists of Fawkes' interface generator (checker.cpp), several names in a line, because the lists are long.
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
"""The names that data fields, enums, enum items and constants cannot have."""

RESERVED_IN_MESSAGES: Final = frozenset(
    {
        "id", "mark_enqueued", "enqueued", "time_enqueued", "sender_id", "sender_thread_name",
        "interface", "type", "fields", "fields_end", "num_fields", "datachunk", "datasize", "hops",
        "from_chunk", "recipient", "clone", "of_type", "as_type",
    }
)
"""The names that fields of messages cannot have."""
# fmt: on

_IDENTIFIER = re.compile(r"(?!__)[A-Za-z_][A-Za-z0-9_]*")


def is_identifier(name: str) -> bool:
    """Return whether a name has the form of an identifier in C++ and Python, and no leading ``__``.

    Keywords have this form, too. C++ reserves names such as ``__x``, and Python renames them within classes.
    """
    return _IDENTIFIER.fullmatch(name) is not None


def interface_type_name(name: str) -> str:
    """Return a name, with the suffix ``Interface`` appended unless the name contains it."""
    return name if INTERFACE_SUFFIX in name else name + INTERFACE_SUFFIX


def message_type_name(name: str) -> str:
    """Return a name, with the suffix ``Message`` appended unless the name contains it."""
    return name if MESSAGE_SUFFIX in name else name + MESSAGE_SUFFIX
