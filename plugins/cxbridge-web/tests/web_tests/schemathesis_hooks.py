"""Additional checks for schemathesis, which loads the file named by SCHEMATHESIS_HOOKS."""

from __future__ import annotations

import schemathesis

UNLOADED_REASONS = (
    "Behavior Engine plugin is not loaded",
    "No CLIPS environment named 'executive' found",
    "The executive is not running now",
    "there is no daemon with an executive",
    "The CLIPS environment 'executive' was replaced during the request",
)
"""Errors of requests after an earlier request has unloaded the component."""

SERVER_ERRORS = 500
UNAVAILABLE = 503


@schemathesis.check
def server_errors_have_unloaded_reason(_context, response, _case):
    """Allow only status 503 of the server errors, with a documented reason."""
    text = response.content.decode()
    if response.status_code >= SERVER_ERRORS:
        is_allowed = response.status_code == UNAVAILABLE and text.startswith(UNLOADED_REASONS)
        assert is_allowed, f"{response.status_code}: {text}"
