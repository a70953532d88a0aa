"""The findings of the check in Fawkes and fawkes-robotino equal the judged findings."""

from __future__ import annotations

import pytest

from cxbridge_studio.check.findings import Severity
from cxbridge_studio.check.table import load_codes
from studio_tests.check.judged import SPECS, check_spec, list_places, load_judgements
from tests.support import needs_fawkes, needs_robotino


def _marks(spec: str) -> pytest.MarkDecorator:
    return needs_robotino if spec.startswith("rcll") else needs_fawkes


@pytest.mark.parametrize("spec", [pytest.param(spec, marks=_marks(spec)) for spec in SPECS])
def test_findings_equal_judged_findings(spec):
    if spec.startswith("rcll"):
        pytest.importorskip("grpc_tools", reason="the extra 'protobuf' (grpcio-tools) is not installed")
    findings = check_spec(spec)
    expected = {
        (judgement.code, judgement.place): judgement
        for judgement in load_judgements()
        if judgement.spec == spec
    }
    assert sorted(list_places(findings)) == sorted(expected)
    for finding, key in zip(findings, list_places(findings), strict=True):
        name = expected[key].reason.split()[0].rstrip(":;")
        assert name in finding.message, (key, finding.message)


def test_nine_of_ten_findings_and_all_errors_are_right():
    wrong = [judgement for judgement in load_judgements() if not judgement.is_right]
    assert len(wrong) <= 0.1 * len(load_judgements())
    assert all(load_codes()[judgement.code].severity is not Severity.ERROR for judgement in wrong)
