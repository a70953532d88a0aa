"""The list of all endpoints: modules of ``fawkes/``, operations and extensions."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from typing import TYPE_CHECKING

import cxbridge_web.fawkes
from cxbridge_web import operations
from cxbridge_web.endpoint import Directory
from cxbridge_web.extensions import blackboard, clips, status

if TYPE_CHECKING:
    from cxbridge_web.extensions.state import ServerState


def make_directory(state: ServerState) -> Directory:
    """Return all endpoints.

    Each module of ``fawkes/`` contributes its ``ENDPOINTS``.
    """
    modules = pkgutil.iter_modules(cxbridge_web.fawkes.__path__)
    components = [import_module(f"{cxbridge_web.fawkes.__name__}.{module.name}") for module in modules]
    fawkes_endpoints = [
        endpoint for component in components for endpoint in getattr(component, "ENDPOINTS", ())
    ]
    extensions = [
        endpoint for module in (status, clips, blackboard) for endpoint in module.make_endpoints(state)
    ]
    return Directory([*fawkes_endpoints, *operations.make_endpoints(), *extensions])
