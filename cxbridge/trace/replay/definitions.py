"""Adds the interface types that are attached to a recording to a registry."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import PurePath

from cxbridge.blackboard.names import parse_uid
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interfaces.xml.parser import parse_bytes
from cxbridge.trace.formats.base import Run


def add_attached(registry: InterfaceRegistry, run: Run, uids: Iterable[str]) -> None:
    """Add to a registry the types that it does not know and that are attached to the run as ``<Type>.xml``.

    :raises InterfaceDefinitionError: when such a file is wrong.
    """
    missing = {kind for kind, _ in map(parse_uid, uids) if registry.path(kind) is None}
    if not missing:
        return
    for attachment in run.attachments():
        name = PurePath(attachment.name)
        if name.suffix == ".xml" and name.stem in missing:
            file = f"{run.path}: {attachment.name}"
            registry.add(make_interface_class(parse_bytes(attachment.data, file)))
