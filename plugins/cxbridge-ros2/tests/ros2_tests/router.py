"""A router of Zenoh, as rmw_zenohd: ``python -m ros2_tests.router PORT``."""

from __future__ import annotations

import json
import sys
import threading

import zenoh


def main() -> None:
    config = zenoh.Config()
    settings = {
        "mode": "router",
        "listen/endpoints": [f"tcp/127.0.0.1:{sys.argv[1]}"],
        "scouting/multicast/enabled": False,
    }
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config):
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        threading.Event().wait()


if __name__ == "__main__":
    main()
