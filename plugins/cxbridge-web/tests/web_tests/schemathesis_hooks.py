"""Additional checks of schemathesis, which loads this file by SCHEMATHESIS_HOOKS."""

from __future__ import annotations

import schemathesis

NOT_NOW = (
    "Behavior Engine plugin is not loaded",
    "No CLIPS environment named 'executive' found",
    "The executive is not running now",
    "there is no daemon with an executive",
    "The CLIPS environment 'executive' was replaced during the request",
)
"""Why a request cannot be answered after an earlier request has unloaded its component."""

SERVER_ERRORS = 500
UNAVAILABLE = 503


@schemathesis.check
def only_what_is_unloaded_is_missing(_context, response, _case):
    """No 5xx but 503, and that for one of the documented reasons."""
    text = response.content.decode()
    if response.status_code >= SERVER_ERRORS:
        known = response.status_code == UNAVAILABLE and text.startswith(NOT_NOW)
        assert known, f"{response.status_code}: {text}"
