"""The served API against its own description: described requests are answered, no undocumented 5xx."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys

import pytest

from tests.support import ROOT, TEST_FOLDERS
from web_tests.support import serving

CHECKS = (
    "response_schema_conformance,content_type_conformance,status_code_conformance,"
    "only_what_is_unloaded_is_missing"
)
LIMIT_S = 120
NOT_ASKED = "/cxbridge/events"
"""A stream has no end."""


@pytest.mark.skipif(importlib.util.find_spec("schemathesis") is None, reason="schemathesis is not installed")
def test_the_api_keeps_to_its_description():
    with serving(config=ROOT / "scenarios" / "test-scenario") as (_, client, _lines):
        paths = client.get("/api/openapi.json").json["paths"]
        operations = sum(len(methods) for path, methods in paths.items() if path != NOT_ASKED)
        options = [
            "--checks",
            CHECKS,
            "--phases",
            "fuzzing",
            "--max-examples",
            "2",
            "--workers",
            "4",
            "--warnings",
            "off",
        ]
        options += ["--suppress-health-check", "all"]  # a busy machine is not a defect
        done = subprocess.run(
            [
                *(sys.executable, "-m", "schemathesis.cli", "run", f"{client.url}/api/openapi.json"),
                *(*options, "--no-color", "--request-timeout", "15"),
                *("--generation-database", "none", "--seed", "7", "--exclude-path", NOT_ASKED),
            ],
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            check=False,
            cwd=ROOT,
            env={
                **os.environ,
                "PYTHONPATH": os.pathsep.join(TEST_FOLDERS),
                "SCHEMATHESIS_HOOKS": "web_tests.schemathesis_hooks",
            },
        )
        assert done.returncode == 0, done.stdout[done.stdout.find("FAILURES") :][:6000] + done.stderr[-2000:]
        assert f" {operations} passed" in done.stdout, done.stdout[-3000:]
        assert client.get("/api/cxbridge/status").status == 200
