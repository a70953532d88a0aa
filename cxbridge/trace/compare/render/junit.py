"""Output of a comparison as a JUnit file for CI services."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as ET

from cxbridge.file_access import replaced_file
from cxbridge.printing import visible
from cxbridge.trace.compare.render.text import ComparisonReport, difference_title, text_report

# The characters that XML 1.0 forbids.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_junit(path: Path, report: ComparisonReport) -> None:
    """Write a test case that fails if the runs differ.

    :raises CxbridgeError: if the file cannot be written.
    """
    comparison = report.comparison
    level = f"{comparison.view.value}.{comparison.order.value}"
    counts = {"tests": "1", "failures": "0" if comparison.same else "1", "errors": "0", "skipped": "0"}
    suites = ET.Element("testsuites", counts)
    suite = ET.SubElement(suites, "testsuite", {"name": "cxbridge trace diff", **counts})
    name = _make_xml_safe(f"{report.a.path} is the same as {report.b.path}")
    case = ET.SubElement(suite, "testcase", {"classname": f"trace.diff.{level}", "name": name})
    text = _make_xml_safe("\n".join(text_report(report)))
    if not comparison.same:
        failure = ET.SubElement(
            case,
            "failure",
            {"type": "difference", "message": _make_xml_safe(difference_title(comparison.differences[0]))},
        )
        failure.text = text
    else:
        ET.SubElement(case, "system-out").text = text
    tree = ET.ElementTree(suites)
    ET.indent(tree)
    with replaced_file(path) as new_path:
        tree.write(new_path, encoding="utf-8", xml_declaration=True)


def _make_xml_safe(text: str) -> str:
    """Replace characters that XML cannot contain, and control characters that could harm a terminal."""
    return _FORBIDDEN.sub("\ufffd", visible(text))
