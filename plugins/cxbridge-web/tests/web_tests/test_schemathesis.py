"""The REST API compared with its description by schemathesis."""

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
    "server_errors_have_unloaded_reason"
)
LIMIT_S = 120
EXCLUDED_PATH = "/cxbridge/events"
"""A stream without an end."""


@pytest.mark.skipif(importlib.util.find_spec("schemathesis") is None, reason="schemathesis is not installed")
def test_answers_match_description():
    with serving(config=ROOT / "scenarios" / "test-scenario") as (_, client, _lines):
        paths = client.get("/api/openapi.json").json["paths"]
        operations = sum(len(methods) for path, methods in paths.items() if path != EXCLUDED_PATH)
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
        options += ["--suppress-health-check", "all"]  # a loaded machine is not a defect
        process = subprocess.run(
            [
                *(sys.executable, "-m", "schemathesis.cli", "run", f"{client.url}/api/openapi.json"),
                *(*options, "--no-color", "--request-timeout", "15"),
                *("--generation-database", "none", "--seed", "7", "--exclude-path", EXCLUDED_PATH),
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
        assert process.returncode == 0, (
            process.stdout[process.stdout.find("FAILURES") :][:6000] + process.stderr[-2000:]
        )
        assert f" {operations} passed" in process.stdout, process.stdout[-3000:]
        assert client.get("/api/cxbridge/status").status == 200
