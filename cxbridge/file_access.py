"""Whether files can be read, asked of the system that would have to open them."""

from __future__ import annotations

import errno
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from cxbridge.errors import CxbridgeError

ABSENT: Final = "is not there"
"""Why a path names no file, when there is nothing."""

_NOTHING_THERE: Final = frozenset({errno.ENOENT, errno.ENOTDIR, errno.ELOOP})


@contextmanager
def file_errors() -> Iterator[None]:
    """Turn what the system refuses of a file into an error that names the file.

    For processes that send their errors to another one; the command line shows an OSError in the same way.

    :raises CxbridgeError: instead of an OSError that has a file.
    """
    try:
        yield
    except OSError as error:
        if error.filename is None:
            raise
        raise CxbridgeError(error.strerror or str(error), file=error.filename) from error


def is_readable_file(path: str | Path) -> bool:
    """Return whether there is a regular file that can be opened; to open a pipe may take forever."""
    return not why_unreadable(path)


def why_unreadable(path: str | Path) -> str:
    """Return why a path names no file that can be read, to follow its name; empty when it does.

    A folder on the way that may not be searched is a reason, too: nobody knows what is in it.
    """
    path = Path(path)
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            return "is not a regular file"
        path.open("rb").close()
    except (OSError, ValueError) as error:
        if getattr(error, "errno", None) not in _NOTHING_THERE:
            return f"cannot be read: {getattr(error, 'strerror', None) or error}"
        return f"is a link to {path.readlink()}, which leads to no file" if path.is_symlink() else ABSENT
    return ""
