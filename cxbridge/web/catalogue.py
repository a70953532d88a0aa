"""All endpoints of the API."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.web import own
from cxbridge.web.endpoint import Directory
from cxbridge.web.fawkes import executive

if TYPE_CHECKING:
    from cxbridge.web.own import Figures


def directory(figures: Figures) -> Directory:
    """Return all endpoints."""
    return Directory([*executive.ENDPOINTS, *own.endpoints(figures)])
