"""Mistakes in scenario.yaml."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table.mistake import STUCK, Mistake, mistake

_FILE: Final = "scenario.yaml"

MISTAKES: Final[tuple[Mistake, ...]] = (
    mistake(
        "the colon of a key is missing",
        _FILE,
        "  spec: hello",
        "  spec hello",
        "not valid YAML",
        "scenario.yaml:3",
    ),
    mistake(
        "a tab indents a line", _FILE, "  spec: hello", "\tspec: hello", "not valid YAML", "scenario.yaml:2"
    ),
    mistake(
        "a bracket never closes",
        _FILE,
        "hello-plan.clp]",
        "hello-plan.clp",
        "not valid YAML",
        "scenario.yaml:18",
    ),
    mistake(
        "the spec is misspelt",
        _FILE,
        "  spec: hello",
        "  spec: helo",
        "has no spec 'helo'",
        "scenario.yaml:2",
    ),
    mistake(
        "the section is misspelt",
        _FILE,
        "clips-executive:\n",
        "clips-executiv:\n",
        "'clips-executiv' is never read",
        "scenario.yaml:2",
    ),
    mistake("no spec is named", _FILE, "  spec: hello\n", "", "names no spec", "scenario.yaml:2"),
    mistake(
        "a file is misspelt",
        _FILE,
        "hello-goals.clp,",
        "hello-gaols.clp,",
        "hello-gaols.clp",
        "scenario.yaml:17",
    ),
    mistake(
        "a feature is misspelt",
        _FILE,
        "pddl-parser",
        "pddl-praser",
        "asks for the feature 'pddl-praser', which is not available",
        "scenario.yaml:12",
    ),
    mistake(
        "an entry has no name",
        _FILE,
        "name: domain",
        "nmae: domain",
        "'nmae' is never read",
        "scenario.yaml:14",
    ),
    mistake("a stage is misspelt", _FILE, "stage-3", "stage3", "there is no 'stage3'", "scenario.yaml:14"),
    mistake(
        "files are a text",
        _FILE,
        "[hello-goals.clp, hello-plan.clp]",
        "hello-goals.clp",
        "must be a list of file names",
        "scenario.yaml:17",
    ),
    mistake(
        "a stage is a map",
        _FILE,
        "          - name: pddl-parser",
        "          name: pddl-parser",
        "stage-1 must be a list of entries",
        "scenario.yaml:12",
    ),
    mistake(
        "a truth value is a word",
        _FILE,
        "automatic-goal-retraction: true",
        "automatic-goal-retraction: yes please",
        "must be true or false",
        "scenario.yaml:4",
    ),
    mistake(
        "the feature is not requested",
        _FILE,
        "          - name: pddl-parser\n",
        "          - name: planner\n",
        "parse-pddl-domain",
        "hello-domain.clp:5",
    ),
    mistake(
        "a signal that never comes is waited for",
        _FILE,
        "            file: hello-domain.clp\n",
        "            file: hello-domain.clp\n            wait-for: godot\n",
        "waits for the signal godot",
        "scenario.yaml:16",
        status=STUCK,
    ),
    mistake(
        "the skill space is misspelt",
        _FILE,
        "skillspace: hello",
        "skillspace: helo",
        "skill space 'helo'",
        "scenario.yaml:21",
    ),
)
