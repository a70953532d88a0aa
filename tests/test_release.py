"""The release workflow: steps are existing commands; only the publishing jobs have rights."""

from __future__ import annotations

import re
import subprocess
import sys

import yaml

from cxbridge import __version__
from tests.support import ROOT

WORKFLOW = yaml.safe_load((ROOT / ".github" / "workflows" / "release.yml").read_text())
JOBS = WORKFLOW["jobs"]


def test_tag_of_another_version_is_refused():
    def check(tag):
        call = [sys.executable, ROOT / ".ci" / "release_version.py", tag]
        return subprocess.run(call, capture_output=True, text=True, check=False)

    assert check(f"v{__version__}").returncode == 0
    refused = check("v9.9.9")
    assert refused.returncode == 1
    assert (
        f"plugins/cxbridge-web/pyproject.toml: version {__version__}, but the tag is v9.9.9" in refused.stderr
    )


def test_commands_of_workflow_exist():
    commands = [step["run"] for job in JOBS.values() for step in job["steps"] if "run" in step]
    files = {name for text in commands for name in re.findall(r"[\w./-]*\.ci/[\w.]+", text)}
    assert {name for name in files if not (ROOT / name).is_file()} == set()
    targets = {name for text in commands for name in re.findall(r"make \"?([\w-]+)", text)}
    assert targets == {"package", "test-"}
    makefile = (ROOT / "Makefile").read_text()
    assert all(re.search(rf"^{name}(%|core)?:", makefile, re.MULTILINE) for name in targets)


def test_only_last_jobs_may_sign_without_password():
    assert WORKFLOW["permissions"] == {}
    assert {name: job["permissions"] for name, job in JOBS.items()} == {
        "build": {"contents": "read"},
        "attest": {"attestations": "write", "id-token": "write"},
        "publish": {"id-token": "write"},
    }
    assert "secrets." not in (ROOT / ".github" / "workflows" / "release.yml").read_text()
