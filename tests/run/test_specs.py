"""The parts of a configuration that the executive reads are checked before anything runs."""

from __future__ import annotations

import pytest

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.run.specs import check_spec, choose_spec
from tests.support import FAWKES_DIR, needs_fawkes, needs_plugin

GOOD = """
clips-executive:
  spec: s
  specs:
    s:
      init:
        stage-1:
          - name: pddl-parser
        stage-3:
          - {name: a, file: a.clp, feature-request: false, wait-for: x}
          - {name: b, files: [b.clp, "BATCH|c.clp"]}
      action-mapping: {go: "go{}"}
"""


def configuration(text):
    return Configuration.from_text(text, "f.yaml")


def test_valid_spec_has_no_warning():
    config = configuration(GOOD)
    assert choose_spec(config, None) == "s"
    assert check_spec(config, "s") == []


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (
            "      init:\n        stage-1:\n          - name: pddl-parser\n        stage-3:\n",
            "      init: x\n      y:\n",
            6,
            "'init' must be a map of stages",
        ),
        ("stage-1:\n          - name: pddl-parser", "stage-1: x", 7, "'stage-1' must be a list of entries"),
        ("stage-1:\n          - name", "stage-9:\n          - name", 8, "there is no 'stage-9'"),
        ("- name: pddl-parser", "name: x", 8, "stage-1 must be a list of entries"),
        ("- name: pddl-parser", "- file: x", 8, "stage-1, entry 1 has no name"),
        ("- name: pddl-parser", "- name: [a]", 8, "name"),
        ("feature-request: false", "feature-request: maybe", 10, "feature-request"),
        ('files: [b.clp, "BATCH|c.clp"]', "files: b.clp", 11, "must be a list of file names"),
        ('files: [b.clp, "BATCH|c.clp"]', "files: [1, 2]", 11, "must be a list of file names"),
        ('files: [b.clp, "BATCH|c.clp"]', "files: {b: c}", 11, "must be a list, not a map"),
        ('{go: "go{}"}', "x", 12, "'action-mapping' must be a map"),
        ('{go: "go{}"}', "[a, b]", 12, "'action-mapping' must be a map"),
        ("  spec: s\n", "  spec: s\n  debug: x\n", 4, "'debug' must be a map"),
        ("  spec: s\n", "  spec: s\n  steal-skiller-control: x\n", 4, "steal-skiller-control"),
        ("  spec: s\n", "  spec: s\n  clips-dirs: {a: b}\n", 4, "clips-dirs"),
        ("\nclips", "\nskiller: {skillspace: {a: b}}\nclips", 2, "skillspace"),
        ("  spec: s\n", "  spec: other\n", 3, "has no spec 'other'"),
    ],
)
def test_wrong_type_is_an_error_with_place(old, new, line, message):
    assert old in GOOD
    config = configuration(GOOD.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        check_spec(config, choose_spec(config, None))
    assert message in caught.value.message
    assert (caught.value.file, caught.value.line) == ("f.yaml", line)


def test_unknown_keys_are_warnings():
    config = configuration(GOOD.replace("file: a.clp", "flie: a.clp"))
    (warning,) = check_spec(config, "s")
    assert warning.startswith("f.yaml:10: 'flie' of stage-3, entry 1 is never read")


@needs_fawkes
@pytest.mark.parametrize("spec", ["test", pytest.param("test-pddl", marks=needs_plugin("planning"))])
def test_specs_of_fawkes_have_no_warning(spec):
    assert FAWKES_DIR is not None
    assert check_spec(Configuration.load(FAWKES_DIR / "cfg"), spec) == []
