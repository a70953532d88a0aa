"""The names within our mcap files, as docs/formats.md describes them."""

from __future__ import annotations

from collections.abc import Mapping

PROFILE = "cxbridge"
"""The profile in the header of our files."""

METADATA = "cxbridge"
"""The name of our metadata records; later ones add to earlier ones."""

SOURCE = "cxbridge.source"
"""The name of the metadata records of what a run was made of."""

INTERFACE_TOPICS: Mapping[str, str] = {"interface": "/bb/", "message": "/messages/"}
"""Start of the topics of interface writes and messages: ``/bb/<Type>/<id>``."""

TOPICS: Mapping[str, str] = {
    "log": "/log",
    "rule": "/rules",
    "fact": "/facts",
    "goal": "/goals",
    "plan-action": "/plan-actions",
    "skill": "/skills",
    "planner": "/planner",
}
"""The topic of each other kind of event, by its name in :data:`cxbridge.trace.codec.KINDS`."""
