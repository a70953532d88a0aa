"""Names of constructs in an environment."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.clipstext.syntax import without_module
from cxbridge.executive.host.values import Symbol

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


def construct_names(env: ClipsEnvironment, construct: str) -> frozenset[str]:
    """Return the names of all constructs of a kind, without their modules.

    :param construct: e.g. ``deftemplate``, which includes those of ordered facts, or ``defrule``.
    """
    names = env.call(f"get-{construct}-list", Symbol("*"))  # of all modules
    return frozenset(without_module(str(name)) for name in names) if isinstance(names, tuple) else frozenset()
