"""A broken agent on the command line: what is wrong with it is said by the check."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cxbridge.errors import BrokenAgentError

if TYPE_CHECKING:
    from cxbridge.run.options import RunOptions


@contextmanager
def in_words_of_check(options: RunOptions) -> Iterator[None]:
    """Let a :class:`BrokenAgentError` say what the check says: the word that is wrong, and what was meant.

    :param options: of the run.
    :raises BrokenAgentError: when one was raised.
    """
    try:
        yield
    except BrokenAgentError as error:
        from cxbridge_studio.check.broken import with_findings

        raise with_findings(error, options) from None
