"""The list of all endpoints of the API: of each module of ``fawkes/``, of each operation, and our own."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from typing import TYPE_CHECKING

import cxbridge.web.fawkes
from cxbridge.web import extensions, operations
from cxbridge.web.endpoint import Directory

if TYPE_CHECKING:
    from cxbridge.web.extensions import Figures


def directory(figures: Figures) -> Directory:
    """Return all endpoints."""
    modules = pkgutil.iter_modules(cxbridge.web.fawkes.__path__)
    views = [import_module(f"{cxbridge.web.fawkes.__name__}.{module.name}") for module in modules]
    of_fawkes = [endpoint for view in views for endpoint in getattr(view, "ENDPOINTS", ())]
    return Directory([*of_fawkes, *operations.endpoints(), *extensions.endpoints(figures)])
