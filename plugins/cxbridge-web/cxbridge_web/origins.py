"""Rules for the host and the origin of requests: which pages of browsers may use a server."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from cxbridge.listening import LOOPBACK

LOCAL_NAMES: Final = frozenset({"localhost", LOOPBACK, "::1"})
"""The names of this machine in the header ``Host``."""


def has_host_name(host: str, names: Collection[str]) -> bool:
    """Return whether the header ``Host``, with or without a port, has one of some names."""
    name = host[1:].partition("]")[0] if host.startswith("[") else host.partition(":")[0]
    return name.lower() in names


def is_permitted_request(origin: str, scheme: str, host: str, allowed_origins: Collection[str]) -> bool:
    """Return whether a request comes from the server's own page or from an allowed page.

    Programs that are not browsers send requests without an origin; these are permitted, too.

    :param origin: the header ``Origin``; empty without that header.
    :param scheme: the scheme of the request, ``http`` or ``https``.
    :param host: the header ``Host``.
    :param allowed_origins: the origins of other permitted pages; ``*`` allows all.
    """
    return (
        not origin
        or is_allowed_origin(origin, allowed_origins)
        or origin.lower() == f"{scheme}://{host}".lower()
    )


def is_allowed_origin(origin: str, allowed_origins: Collection[str]) -> bool:
    """Return whether an origin is one of the allowed origins; ``*`` allows all, but no empty origin."""
    return bool(origin) and ("*" in allowed_origins or origin in allowed_origins)
