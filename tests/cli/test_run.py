"""The command `cxbridge run`."""

from __future__ import annotations

import json

from cxbridge.cli.main import invoke
from tests.run.mini import write_scenario


def test_json_of_result_is_alone_on_stdout(tmp_path, capsys):
    assert invoke(["run", str(write_scenario(tmp_path)), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["status"], result["result"], result["spec"]) == (0, "completed", "mini")
    assert result["goals"][0]["outcome"] == "COMPLETED"


def test_wrong_usage_is_status_2(capsys):
    assert invoke(["run", "--no-such-option"]) == 2
    assert invoke(["no-such-command"]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_version(capsys):
    assert invoke(["--version"]) == 0
    assert capsys.readouterr().out.startswith("cxbridge 0.")


def test_doctor_finds_no_problem(capsys):
    assert invoke(["doctor"]) == 0
    assert invoke(["doctor", "--json"]) == 0
    findings = json.loads(capsys.readouterr().out.split("\n[", 1)[1].join(["[", ""]))
    assert all(finding["fine"] for finding in findings if finding["required"])
