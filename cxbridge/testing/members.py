"""Members that plug-ins add to the fixture ``cx`` and to its runs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Final

from cxbridge.plugins import Table, package_hint

MEMBERS: Final[Table[Callable[..., Any]]] = Table(
    "MEMBERS", callable, "a function whose first parameter is the fixture or the run"
)
"""The functions by name: a function ``cx.NAME`` gets the fixture, a function ``run.NAME`` an ``AgentRun``."""


def find_member(owner: str, subject: object, name: str) -> Callable[..., Any]:
    """Return the function of a plug-in as a method of the fixture or of a run.

    :param owner: ``cx`` or ``run``.
    :param subject: the fixture or the run.
    :raises AttributeError: if no installed plug-in has the member; the error names the package that has
        the member, or the documentation if no known package has it.
    """
    member = f"{owner}.{name}"
    for row in MEMBERS.rows:
        if row.name == member:
            return partial(MEMBERS.load_target(row), subject)
    hint = package_hint(member) or "docs/testing.md lists the members"
    raise AttributeError(f"{owner} has no member '{name}'; {hint}", name=name, obj=subject)
