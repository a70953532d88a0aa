"""The check's findings in foreign trees are those that were judged by hand, and 9 of 10 are right."""

from __future__ import annotations

import pytest

from cxbridge_studio.check.findings import Severity
from cxbridge_studio.check.table import load_codes
from studio_tests.check.judged import SPECS, found, judged, places
from tests.support import needs_fawkes, needs_robotino


def _marks(spec: str) -> pytest.MarkDecorator:
    return needs_robotino if spec.startswith("rcll") else needs_fawkes


@pytest.mark.parametrize("spec", [pytest.param(spec, marks=_marks(spec)) for spec in SPECS])
def test_an_agent_has_the_findings_that_were_judged_and_no_others(spec):
    if spec.startswith("rcll"):
        pytest.importorskip("grpc_tools", reason="the extra 'protobuf' (grpcio-tools) is not installed")
    findings = found(spec)
    wanted = {(each.code, each.place): each for each in judged() if each.spec == spec}
    assert sorted(places(findings)) == sorted(wanted)
    for finding, key in zip(findings, places(findings), strict=True):
        name = wanted[key].reason.split()[0].rstrip(":;")
        assert name in finding.message, (key, finding.message)


def test_nine_of_ten_are_right_and_no_error_is_wrong():
    wrong = [each for each in judged() if not each.is_right]
    assert len(wrong) <= 0.1 * len(judged())
    assert all(load_codes()[each.code].severity is not Severity.ERROR for each in wrong)
