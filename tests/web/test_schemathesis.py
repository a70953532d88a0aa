"""The served API against its own description: no 5xx, and what is described is what is answered."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest

from tests.support import ROOT
from tests.web.support import serving

CHECKS = "not_a_server_error,response_schema_conformance,content_type_conformance,status_code_conformance"
LIMIT_S = 120
NOT_ASKED = ("/cxbridge/events", "/cxbridge/pause", "/cxbridge/reset", "/plugins/{name}")
"""A stream has no end; without executive or Skiller 503 is the right answer."""


@pytest.mark.skipif(importlib.util.find_spec("schemathesis") is None, reason="schemathesis is not installed")
def test_the_api_keeps_to_its_description():
    with serving(config=ROOT / "scenarios" / "test-scenario") as (_, client, _lines):
        options = ["--checks", CHECKS, "--phases", "fuzzing", "--max-examples", "3", "--warnings", "off"]
        done = subprocess.run(
            [
                *(sys.executable, "-m", "schemathesis.cli", "run", f"{client.url}/api/openapi.json"),
                *(*options, "--no-color", "--request-timeout", "15"),
                *("--generation-database", "none"),
                *(part for path in NOT_ASKED for part in ("--exclude-path", path)),
            ],
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )
        assert done.returncode == 0, done.stdout[done.stdout.find("FAILURES") :][:6000]
        assert " passed" in done.stdout
        assert client.get("/api/cxbridge/status").status == 200
