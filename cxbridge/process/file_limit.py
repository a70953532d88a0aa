"""The number of files that the process may open: sockets are files, too."""

from __future__ import annotations

import sys
from typing import Final

FOR_OWN_USE: Final = 512
"""Files that are kept for other things than the clients of one server: recordings, pipes, other servers."""

_ENOUGH: Final = 16384
_WITHOUT_A_LIMIT: Final = 8192


def raise_file_limit() -> int:
    """Let the process open as many files as allowed, up to 16384; returns the number.

    1024, the usual limit, can be used up by clients that merely connect.
    """
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
"""One file of this many is for connections over ZeroMQ, at most."""

WEB_SHARE: Final = 8
"""One file of this many is for connections to the web server."""

_FEWEST: Final = 8


def share(files: int, most: int, part: int) -> int:
    """Return how many connections a server may have, so that no server uses up the files of another.

    :param files: how many the process may open.
    :param most: the number that the server wants.
    :param part: the server gets one file of this many.
    """
    return min(most, max(_FEWEST, files // part))


def most_clients(files: int, most: int) -> int:
    """Return how many clients one server may have, of a process that may open ``files``."""
    return max(1, min(most, files - FOR_OWN_USE, files // 2))
