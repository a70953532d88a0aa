"""All endpoints of the API."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.web import debugging, environments, managers, own
from cxbridge.web.endpoint import Directory
from cxbridge.web.fawkes import blackboard, clips, executive, skiller, webview

if TYPE_CHECKING:
    from cxbridge.web.own import Figures


def directory(figures: Figures) -> Directory:
    """Return all endpoints."""
    fawkes = (executive, clips, skiller, blackboard, webview)
    parts = (*fawkes, debugging, environments, managers)
    return Directory([*(endpoint for part in parts for endpoint in part.ENDPOINTS), *own.endpoints(figures)])
