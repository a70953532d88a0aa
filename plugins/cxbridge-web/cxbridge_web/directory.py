"""Makes the directory of all endpoints: of the modules of ``fawkes/``, of operations and of extensions."""

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
    infos = pkgutil.iter_modules(cxbridge_web.fawkes.__path__)
    modules = [import_module(f"{cxbridge_web.fawkes.__name__}.{info.name}") for info in infos]
    fawkes_endpoints = [endpoint for module in modules for endpoint in getattr(module, "ENDPOINTS", ())]
    extensions = [
        endpoint for module in (status, clips, blackboard) for endpoint in module.make_endpoints(state)
    ]
    return Directory([*fawkes_endpoints, *operations.make_endpoints(), *extensions])
