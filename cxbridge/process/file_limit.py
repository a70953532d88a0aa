"""The limit of open files, which include sockets."""

from __future__ import annotations

import sys
from typing import Final

FOR_OWN_USE: Final = 512
"""The files reserved for uses other than clients of a server, such as recordings and pipes."""

_ENOUGH: Final = 16384
_WITHOUT_A_LIMIT: Final = 8192


def raise_file_limit() -> int:
    """Raise the limit of open files as far as allowed, up to 16384; return it."""
    # clients that merely connect can exhaust the usual limit of 1024
    if sys.platform == "win32":
        return _WITHOUT_A_LIMIT
    try:
        import resource  # noqa: PLC0415 - not every system has it
    except ImportError:
        return _WITHOUT_A_LIMIT
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _ENOUGH if hard == resource.RLIM_INFINITY else min(hard, _ENOUGH)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        except (OSError, ValueError):  # macOS has a second limit
            wanted = soft
        return wanted
    return wanted if soft == resource.RLIM_INFINITY else soft


ZMQ_SHARE: Final = 4
"""The divisor of the file limit for connections over ZeroMQ."""

WEB_SHARE: Final = 8
"""The divisor of the file limit for connections to the web server."""

_FEWEST: Final = 8


def share(files: int, most: int, part: int) -> int:
    """Return the number of connections of a server that leaves files for other servers.

    :param files: the file limit of the process.
    :param most: the number that the server requests.
    :param part: the divisor of the file limit.
    """
    return min(most, max(_FEWEST, files // part))


def most_clients(files: int, most: int) -> int:
    """Return the number of clients of one server, by the file limit of the process."""
    return max(1, min(most, files - FOR_OWN_USE, files // 2))
