"""A broken agent on the command line: the explainers add their findings."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cxbridge.errors import BrokenAgentError

if TYPE_CHECKING:
    from cxbridge.run.options import RunOptions


@contextmanager
def in_words_of_check(options: RunOptions) -> Iterator[None]:
    """Add the findings of explainers to a :class:`BrokenAgentError`: the wrong word, the likely right one.

    :param options: of the run.
    :raises BrokenAgentError: when one was raised.
    """
    try:
        yield
    except BrokenAgentError as error:
        from cxbridge.run.explainers import with_explanations

        raise with_explanations(error, options) from None
