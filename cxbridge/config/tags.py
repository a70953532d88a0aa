"""The tags of Fawkes' configuration files, and the values that they allow."""

from __future__ import annotations

import re
import socket
from collections.abc import Callable

from cxbridge.config.documents import Mark, YamlNode, YamlScalar
from cxbridge.config.scalars import to_uint
from cxbridge.errors import ConfigError
from cxbridge.suggestions import did_you_mean

_FRAME = re.compile(r"[a-zA-Z_][a-zA-Z0-9_/-]*")
_PORT_LIMIT = 65535  # Fawkes refuses 65535, too


def _is_address(family: socket.AddressFamily, text: str) -> bool:
    try:
        socket.inet_pton(family, text)
    except (OSError, ValueError, UnicodeError):
        return False
    return True


def _is_port(text: str) -> bool:
    port = to_uint(text)
    return port is not None and 0 < port < _PORT_LIMIT


# By tag: the check of a text, and the description of valid texts for errors.
_CHECKS: dict[str, tuple[Callable[[str], bool], str]] = {
    "frame": (
        lambda text: _FRAME.fullmatch(text) is not None,
        "a frame ID: letters, digits, '_', '-' and '/', starting with a letter or '_'",
    ),
    "ipv4": (lambda text: _is_address(socket.AF_INET, text), "an IPv4 address such as 127.0.0.1"),
    "ipv6": (lambda text: _is_address(socket.AF_INET6, text), 'an IPv6 address such as "::1"'),
    "tcp-port": (_is_port, f"a port from 1 to {_PORT_LIMIT - 1}"),
    "udp-port": (_is_port, f"a port from 1 to {_PORT_LIMIT - 1}"),
    # the other tags are only documentation: in Fawkes, even the pattern for URLs matches any text
    "url": (lambda _text: True, "a URL"),
    "ipv4-addr": (lambda _text: True, "an IPv4 address"),
    "regex": (lambda _text: True, "a regular expression"),
    "topic": (lambda _text: True, "a topic"),
}
INCLUDE_TAGS = ("ignore-missing", "host-specific")
"""The tags of entries of ``include:``."""


def check_tag(node: YamlNode) -> None:
    """Check the value of a node against its tag.

    :raises ConfigError: if the tag is unknown, or the value does not match it.
    """
    if not node.tag:
        return
    if node.tag not in _CHECKS:
        raise unknown_tag_error(node.tag, node.mark)
    check, expected = _CHECKS[node.tag]
    if not isinstance(node, YamlScalar):
        raise node.mark.error(f"the tag !{node.tag} needs a single value", f"write {expected} after it")
    if not check(node.text):
        raise node.mark.error(f"'{node.text}' does not match the tag !{node.tag}", f"write {expected}")


def unknown_tag_error(tag: str, mark: Mark) -> ConfigError:
    """Return the error for an unknown or misplaced tag."""
    if tag in INCLUDE_TAGS:
        return mark.error(
            f"!{tag} is for the entries of 'include:' in the first of two documents",
            "write the includes into a separate document above, and a line '---' after it",
        )
    tags = [f"!{name}" for name in (*_CHECKS, *INCLUDE_TAGS)]
    # without the tags of includes, which no value can have
    hint = f"quote a value that starts with '!'; the known tags are {', '.join(tags[: len(_CHECKS)])}"
    # a tag with a colon is spelled out: the file has !<tag:...>, or a short form such as !!set
    return mark.error(
        f"unknown tag !{tag}" if ":" not in tag else f"unknown tag {tag}",
        did_you_mean(f"!{tag}", tags, hint),
    )
