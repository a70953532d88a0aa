"""The list of all endpoints: modules of ``fawkes/``, operations and extensions."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from typing import TYPE_CHECKING

import cxbridge_web.fawkes
from cxbridge_web import extensions, operations
from cxbridge_web.endpoint import Directory

if TYPE_CHECKING:
    from cxbridge_web.extensions import Figures


def directory(figures: Figures) -> Directory:
    modules = pkgutil.iter_modules(cxbridge_web.fawkes.__path__)
    views = [import_module(f"{cxbridge_web.fawkes.__name__}.{module.name}") for module in modules]
    of_fawkes = [endpoint for view in views for endpoint in getattr(view, "ENDPOINTS", ())]
    return Directory([*of_fawkes, *operations.endpoints(), *extensions.endpoints(figures)])
