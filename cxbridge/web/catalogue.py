"""All endpoints of the API."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.web import extensions, operations
from cxbridge.web.endpoint import Directory
from cxbridge.web.fawkes import blackboard, clips, executive, skiller, webview

if TYPE_CHECKING:
    from cxbridge.web.extensions import Figures


def directory(figures: Figures) -> Directory:
    """Return all endpoints."""
    parts = (executive, clips, skiller, blackboard, webview)
    of_fawkes = [endpoint for part in parts for endpoint in part.ENDPOINTS]
    return Directory([*of_fawkes, *operations.endpoints(), *extensions.endpoints(figures)])
