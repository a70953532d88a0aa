"""Makes the table of all endpoints: of the modules of ``fawkes/``, of operations and of extensions."""

from __future__ import annotations

import pkgutil
from importlib import import_module

import cxbridge_web.fawkes
from cxbridge_web import operations
from cxbridge_web.endpoint import EndpointTable
from cxbridge_web.extensions import blackboard, clips, status


def make_endpoint_table() -> EndpointTable:
    """Return all endpoints; of endpoints with the same path, those of Fawkes come first."""
    module_infos = pkgutil.iter_modules(cxbridge_web.fawkes.__path__)
    modules = [import_module(f"{cxbridge_web.fawkes.__name__}.{info.name}") for info in module_infos]
    fawkes_endpoints = [endpoint for module in modules for endpoint in getattr(module, "ENDPOINTS", ())]
    extensions = [*status.ENDPOINTS, *clips.ENDPOINTS, *blackboard.ENDPOINTS]
    return EndpointTable([*fawkes_endpoints, *operations.make_endpoints(), *extensions])
