"""Opens a Zenoh session with the configuration of rmw_zenoh_cpp, and waits for a router.

Nodes use a router on this machine only to find each other, and then exchange messages directly. A router on
another machine forwards all messages, so that the robot need not reach this machine.
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

DEFAULT_ROUTER: Final = "tcp/localhost:7447"  # the router on this machine

_ATTEMPT_PERIOD_S: Final = 1.0  # time limit of an attempt to find a router, and pause between two attempts
_POLL_PERIOD_S: Final = 0.02  # time between two checks for a router
# The defaults of rmw_zenoh_cpp: nodes find each other through the router and its gossip, not by multicast.
_LOCAL_ROUTER_SETTINGS: Final = {
    "mode": "peer",
    "listen/endpoints": ["tcp/localhost:0"],  # any free port, unreachable from other machines
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": True,
}
_REMOTE_ROUTER_SETTINGS: Final = {"mode": "client", "scouting/multicast/enabled": False}


def open_session(url: str) -> zenoh.Session:
    """Open a session connected to a router.

    :param url: the router, such as ``tcp/robot:7447``; empty for the router in the environment, or on this
        machine.
    :raises Ros2Error: if the configuration is invalid, or there is no router.
    """
    attempt_count = _read_attempt_count()
    config = _make_config(url, is_router_required=attempt_count >= 0)
    reason = ""
    for _ in count() if attempt_count == 0 else range(max(1, attempt_count)):
        if reason:
            time.sleep(_ATTEMPT_PERIOD_S)
        try:
            session = zenoh.open(config)
        except zenoh.ZError as error:
            reason = _one_line(error)
            continue
        if attempt_count < 0 or _wait_for_router(session):
            return session
        session.close()
        reason = "no connection"
    raise Ros2Error(
        f"there is no Zenoh router at {_describe_endpoints(config)}: {reason}",
        hint="start it on the robot (ros2 run rmw_zenoh_cpp rmw_zenohd); ZENOH_ROUTER_CHECK_ATTEMPTS=N waits"
        " N seconds for it",
    )


def make_session_settings(url: str, *, is_router_required: bool = True) -> dict[str, object]:
    """Return the settings of a session by key, without the settings in environment variables.

    :param is_router_required: whether opening the session fails without a router; otherwise the session looks
        for a router in the background.
    """
    endpoint = url or DEFAULT_ROUTER
    return {
        **(_LOCAL_ROUTER_SETTINGS if _is_local(endpoint) else _REMOTE_ROUTER_SETTINGS),
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": 0,  # a single attempt, which `open_session` repeats
        "connect/exit_on_failure": is_router_required,
        "timestamping/enabled": True,  # late subscriptions need the times of messages
    }


def parse_overrides(text: str) -> Iterator[tuple[str, str]]:
    """Yield the keys and values in ZENOH_CONFIG_OVERRIDE: ``key=value;key=value``."""
    for override in text.split(";"):
        key, _, value = override.partition("=")
        if key.strip() and value.strip():
            yield key.strip(), value.strip()


def _make_config(url: str, *, is_router_required: bool) -> zenoh.Config:
    file = os.environ.get("ZENOH_SESSION_CONFIG_URI", "")
    origin = f"ZENOH_SESSION_CONFIG_URI={file}"
    try:
        config = zenoh.Config.from_file(file) if file else zenoh.Config()
        settings: dict[str, object] = {"connect/endpoints": [url]} if url else {}
        if not file:
            settings = make_session_settings(url, is_router_required=is_router_required)
        for key, value in settings.items():
            origin = f"'{url}'"
            config.insert_json5(key, json.dumps(value))
        for key, text in parse_overrides(os.environ.get("ZENOH_CONFIG_OVERRIDE", "")):
            origin = f"ZENOH_CONFIG_OVERRIDE: {key}={text}"
            config.insert_json5(key, text)
    except zenoh.ZError as error:
        raise Ros2Error(
            f"{origin} cannot be used as a configuration of Zenoh: {_one_line(error)}",
            hint="a router's endpoint is e.g. tcp/robot:7447",
        ) from None
    return config


def _read_attempt_count() -> int:
    """Return the number of attempts to find a router, as in rmw_zenoh_cpp.

    0 stands for an unlimited number of attempts, a negative number for no attempt.
    """
    text = os.environ.get("ZENOH_ROUTER_CHECK_ATTEMPTS", "") or "1"
    try:
        return int(text)
    except ValueError:
        raise Ros2Error(f"ZENOH_ROUTER_CHECK_ATTEMPTS={text} is not a number") from None


def _wait_for_router(session: zenoh.Session) -> bool:
    end_s = time.monotonic() + _ATTEMPT_PERIOD_S
    while not session.info.routers_zid():
        if time.monotonic() > end_s:
            return False
        time.sleep(_POLL_PERIOD_S)
    return True


def _describe_endpoints(session_options: zenoh.Config) -> str:
    endpoints = json.loads(session_options.get_json("connect/endpoints"))
    return ", ".join(map(str, endpoints)) if isinstance(endpoints, list) and endpoints else "any endpoint"


def _is_local(endpoint: str) -> bool:
    host = endpoint.partition("/")[2].partition("?")[0].rpartition(":")[0].strip("[]")
    return is_loopback(host)


def _one_line(error: Exception) -> str:
    """Return the text of a Zenoh error without positions in Zenoh's source code."""
    text = " ".join(str(error).partition(" at /")[0].split()).rstrip(".! ")
    return text + "]" * (text.count("[") - text.count("]"))  # the cut part may close brackets
