"""The feature `config`."""

from __future__ import annotations

from cxbridge.executive.host.values import Symbol


def confvals(env):
    return {slots["path"].removeprefix("/a/"): slots for _, _, slots in env.facts("confval")}


def test_values_become_facts_with_fawkes_types(env):
    env.eval('(config-load "/a")')
    found = confvals(env)
    assert {
        path: (slots["type"], slots["value"]) for path, slots in found.items() if slots["is-list"] == "FALSE"
    } == {
        "uint": ("UINT", 5),
        "quoted": ("UINT", 7),
        "int": ("INT", -3),
        "float": ("FLOAT", 2.5),
        "bool": ("BOOL", Symbol("TRUE")),
        "text": ("STRING", 'some "quoted" text'),
        "hex": ("UINT", Symbol("0x10")),
        "maps/0/name": ("STRING", "one"),
        "maps/1/name": ("STRING", "two"),
    }
    assert {path: slots["list-value"] for path, slots in found.items() if slots["is-list"] == "TRUE"} == {
        "empty": (),
        "names": ("x", "y"),
        "numbers": (1, 2),
    }
