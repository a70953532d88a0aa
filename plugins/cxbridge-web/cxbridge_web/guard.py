"""Checks of each request before it is served.

The server may move a robot, and a browser sends requests on behalf of any web page. So the server checks the
origin of the page, to reject requests of foreign pages, and the requested host, to prevent DNS rebinding.
"""

from __future__ import annotations

import base64
import hmac
from collections.abc import MutableMapping
from typing import TYPE_CHECKING, Any, Final

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, Response

from cxbridge_web.origins import LOCAL_NAMES, has_host_name, is_allowed_origin, is_permitted_request
from cxbridge_web.settings import WebSettings

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Receive, Scope, Send

_METHODS: Final = "GET, POST, PUT, PATCH, DELETE, OPTIONS"
_REQUEST_HEADERS: Final = "Authorization, Content-Type, Last-Event-ID"
_MAX_AGE_S: Final = "600"  # time for which browsers may cache the answer to a preflight request
_SECURITY_HEADERS: Final = (
    (b"x-content-type-options", b"nosniff"),  # browsers do not take a text for a script or a page
    (b"referrer-policy", b"no-referrer"),  # linked sites do not learn the address of the server
    (b"x-frame-options", b"DENY"),  # a foreign page cannot show the buttons in a frame
    (b"cross-origin-resource-policy", b"same-origin"),  # nor load replies as images or scripts
)


class Guard:
    """Forwards allowed requests to an application, and answers preflight and rejected requests.

    :param app: the guarded application.
    """

    def __init__(self, app: ASGIApp, settings: WebSettings) -> None:
        self._app = app
        self._token = settings.token
        self._allowed_origins = settings.allow_origins
        self._host_names = LOCAL_NAMES | {settings.host.lower()}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            return  # a WebSocket or the lifespan, which uvicorn does not forward: ws="none", lifespan="off"
        request_headers = Headers(scope=scope)
        origin = request_headers.get("origin", "")
        is_origin_allowed = is_allowed_origin(origin, self._allowed_origins)

        async def send_with_headers(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                cors_headers = (
                    [(b"access-control-allow-origin", origin.encode("latin-1"))] if is_origin_allowed else []
                )
                message["headers"] = [
                    *message.get("headers", ()),
                    *_SECURITY_HEADERS,
                    (b"vary", b"Origin"),
                    *cors_headers,
                ]
            await send(message)

        early_reply = self._make_early_reply(scope, request_headers)
        await (early_reply or self._app)(scope, receive, send_with_headers)

    def _make_early_reply(self, scope: Scope, headers: Headers) -> Response | None:
        """Return the reply to a rejected or a preflight request; None for an allowed request."""
        host = headers.get("host", "")
        # A server with a token may have further names: a page after DNS rebinding does not know the token.
        if not self._token and not has_host_name(host, self._host_names):
            return PlainTextResponse("This server has no such name\n", 421)
        origin = headers.get("origin", "")
        if not is_permitted_request(origin, scope["scheme"], host, self._allowed_origins):
            return PlainTextResponse("Pages of other origins may not use this server\n", 403)
        # Browsers send no origin with the GET of another site's images and scripts, but Sec-Fetch-Site.
        if not origin and _is_foreign_load(scope, headers):
            return PlainTextResponse("Other sites may only link to the pages of this server\n", 403)
        if scope["method"] == "OPTIONS" and "access-control-request-method" in headers:
            return Response(
                status_code=204,
                headers={
                    "Access-Control-Allow-Methods": _METHODS,
                    "Access-Control-Allow-Headers": _REQUEST_HEADERS,
                    "Access-Control-Max-Age": _MAX_AGE_S,
                },
            )
        # A preflight request has no token, so the token is checked last.
        if self._token and not self._has_token(headers.get("authorization", "")):
            return PlainTextResponse(
                "A token is needed\n", 401, headers={"WWW-Authenticate": 'Basic realm="cxbridge"'}
            )
        return None

    def _has_token(self, authorization: str) -> bool:
        """Return whether the header has the token, as a bearer token or as the password of any user."""
        scheme, _, token = authorization.partition(" ")
        token = token.strip()
        if scheme.lower() == "basic":
            try:
                # the credentials are USER:PASSWORD
                token = base64.b64decode(token, validate=True).decode("latin-1").partition(":")[2]
            except ValueError:
                return False
        elif scheme.lower() != "bearer":
            return False
        # The time of the comparison must not depend on the number of correct characters.
        return hmac.compare_digest(token.encode("utf-8"), self._token.encode("utf-8"))


def _is_foreign_load(scope: Scope, headers: Headers) -> bool:
    """Return whether a page of another site made the request, except by a link to a page of the server."""
    # `same-site` is another port or another name of the same domain: not the page of this server
    if headers.get("sec-fetch-site") not in {"cross-site", "same-site"}:
        return False
    return headers.get("sec-fetch-mode") != "navigate" or scope["path"].startswith("/api")
