"""Opens a Zenoh session with the configuration of rmw_zenoh_cpp, and waits for a router.

With a router on this machine, nodes only find each other there and then talk directly. A router elsewhere
forwards all messages, so that the robot need not reach this machine.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from itertools import count
from typing import Final

import zenoh

from cxbridge.errors import Ros2Error
from cxbridge.listening import is_loopback

ROUTER: Final = "tcp/localhost:7447"  # default router of a host

_ATTEMPT_S: Final = 1.0  # seconds of an attempt to find a router, and between two attempts
_POLL_S: Final = 0.02  # seconds between two checks for a router
_WITH_LOCAL_ROUTER: Final = {
    "mode": "peer",
    "listen/endpoints": ["tcp/localhost:0"],  # not reachable from outside
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": True,
}
_WITH_REMOTE_ROUTER: Final = {"mode": "client", "scouting/multicast/enabled": False}


def open_session(url: str) -> zenoh.Session:
    """Open a session connected to a router.

    :param url: the router, such as ``tcp/robot:7447``; empty for that of the environment or of this host.
    :raises Ros2Error: if the configuration is invalid, or there is no router.
    """
    attempts = _attempts()
    config = _config(url, is_needed=attempts >= 0)
    reason = ""
    for _ in count() if attempts == 0 else range(max(1, attempts)):
        if reason:
            time.sleep(_ATTEMPT_S)
        try:
            session = zenoh.open(config)
        except zenoh.ZError as error:
            reason = _one_line(error)
            continue
        if attempts < 0 or _has_router(session):
            return session
        session.close()
        reason = "no connection"
    raise Ros2Error(
        f"there is no Zenoh router at {_endpoints(config)}: {reason}",
        hint="start it on the robot (ros2 run rmw_zenoh_cpp rmw_zenohd); ZENOH_ROUTER_CHECK_ATTEMPTS=N waits"
        " N seconds for it",
    )


def session_settings(url: str, *, is_needed: bool = True) -> dict[str, object]:
    """Return the configuration without the environment's overrides, by key.

    :param is_needed: whether the session requires a router; otherwise it keeps looking for one.
    """
    endpoint = url or ROUTER
    return {
        **(_WITH_LOCAL_ROUTER if _is_local(endpoint) else _WITH_REMOTE_ROUTER),
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": 0,
        "connect/exit_on_failure": is_needed,
        "timestamping/enabled": True,  # late subscriptions need the times of messages
    }


def read_overrides(text: str) -> Iterator[tuple[str, str]]:
    """Yield keys and values of ZENOH_CONFIG_OVERRIDE: ``key=value;key=value``."""
    for override in text.split(";"):
        key, _, value = override.partition("=")
        if key.strip() and value.strip():
            yield key.strip(), value.strip()


def _config(url: str, *, is_needed: bool) -> zenoh.Config:
    file = os.environ.get("ZENOH_SESSION_CONFIG_URI", "")
    setting = f"ZENOH_SESSION_CONFIG_URI={file}"
    try:
        config = zenoh.Config.from_file(file) if file else zenoh.Config()
        settings: dict[str, object] = {"connect/endpoints": [url]} if url else {}
        if not file:
            settings = session_settings(url, is_needed=is_needed)
        for key, value in settings.items():
            setting = f"'{url}'"
            config.insert_json5(key, json.dumps(value))
        for key, text in read_overrides(os.environ.get("ZENOH_CONFIG_OVERRIDE", "")):
            setting = f"ZENOH_CONFIG_OVERRIDE: {key}={text}"
            config.insert_json5(key, text)
    except zenoh.ZError as error:
        raise Ros2Error(
            f"{setting} is no configuration of Zenoh: {_one_line(error)}",
            hint="a router's endpoint is e.g. tcp/robot:7447",
        ) from None
    return config


def _attempts() -> int:
    """Return the number of attempts to find a router; 0 for endless attempts, negative for none."""
    text = os.environ.get("ZENOH_ROUTER_CHECK_ATTEMPTS", "") or "1"
    try:
        return int(text)
    except ValueError:
        raise Ros2Error(f"ZENOH_ROUTER_CHECK_ATTEMPTS={text} is no number") from None


def _has_router(session: zenoh.Session) -> bool:
    end_s = time.monotonic() + _ATTEMPT_S
    while not session.info.routers_zid():
        if time.monotonic() > end_s:
            return False
        time.sleep(_POLL_S)
    return True


def _endpoints(zenoh_settings: zenoh.Config) -> str:
    endpoints = json.loads(zenoh_settings.get_json("connect/endpoints"))
    return ", ".join(map(str, endpoints)) if isinstance(endpoints, list) and endpoints else "any place"


def _is_local(endpoint: str) -> bool:
    host = endpoint.partition("/")[2].partition("?")[0].rpartition(":")[0].strip("[]")
    return is_loopback(host)


def _one_line(error: Exception) -> str:
    """Return Zenoh's error without positions in its source code."""
    text = " ".join(str(error).partition(" at /")[0].split()).rstrip(".! ")
    return text + "]" * (text.count("[") - text.count("]"))
