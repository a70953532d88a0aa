"""Lists in parts."""

from __future__ import annotations

import pytest

from cxbridge_web.paging import PagingError, Window, has_text, matches
from tests.run.mini import AGENT, write_scenario
from web_tests.support import serving

MODELS = [{"kind": "X", "name": f"N{i}", "values": [str(i), "ä" * (i % 2)], "number": i} for i in range(10)]


@pytest.mark.parametrize(
    ("query", "numbers", "total"),
    [
        ({}, range(10), 10),
        ({"limit": "3"}, range(3), 10),
        ({"offset": "8"}, range(8, 10), 10),
        ({"offset": "8", "limit": "1"}, [8], 10),
        ({"offset": "99", "limit": "5"}, [], 10),
        ({"limit": "0"}, [], 10),
        ({"search": "n7"}, [7], 1),
        ({"search": "Ä", "offset": "1", "limit": "2"}, [3, 5], 5),
        ({"search": "X"}, [], 0),
        ({"search": ""}, range(10), 10),
    ],
)
def test_parts(query, numbers, total):
    part = Window.from_query(query).select(MODELS)
    assert [model["number"] for model in part.items] == list(numbers)
    assert part.total == total


@pytest.mark.parametrize("query", [{"limit": "-1"}, {"offset": "x"}, {"limit": "1" * 30}, {"limit": "²"}])
def test_numbers_that_are_none(query):
    with pytest.raises(PagingError, match="must be a whole number"):
        Window.from_query(query)


def test_texts_and_patterns():
    assert has_text({"a": [{"b": "Hello"}]}, "hell")
    assert not has_text({"a": 3, "b": None, "kind": "hello"}, "hell")
    assert matches("goal-meta", "goal*")
    assert matches("goal", "")
    assert not matches("goal", "goa")


@pytest.fixture(name="client", scope="module")
def _client(tmp_path_factory):
    """A daemon that stands: lists are always the same."""
    agent = f"{AGENT}\n(deftemplate thing (slot number))\n(defrule mini-thing (thing) =>)\n"
    scenario = write_scenario(tmp_path_factory.mktemp("paging") / "mini", agent=agent)
    with serving(config=scenario) as (daemon, client, _lines):
        assert client.ask("POST", "/api/cxbridge/pause").status == 200
        env = daemon.node.env
        with env.lock:
            for number in range(20):
                env.assert_string(f"(domain-object (name o{number}) (type t))")
            for number in range(4):
                env.assert_string(f"(thing (number {number}))")
        yield client


@pytest.mark.parametrize(
    "path",
    [
        "/api/clips/executive/facts",
        "/api/clips/executive/facts?formatted=true",
        "/api/clips-executive/domain-objects",
        "/api/clips-executive/goals",
        "/api/clips-executive/plans",
        "/api/cxbridge/rules",
    ],
)
def test_a_part_is_a_part_of_the_whole(client, path):
    join = "&" if "?" in path else "?"
    whole = client.get(path)
    count = len(whole.json)
    assert whole.headers["X-Total-Count"] == str(count)
    for offset, limit in ((0, 1), (1, 3), (max(count - 1, 0), 5), (count, 5)):
        part = client.get(f"{path}{join}offset={offset}&limit={limit}")
        assert part.json == whole.json[offset : offset + limit]
        assert part.headers["X-Total-Count"] == str(count)
    assert client.get(f"{path}{join}limit=x").status == 400


def test_facts_of_a_template_and_with_a_text(client):
    path = "/api/clips/executive/facts?template=domain-object*"
    facts = client.get(f"{path}&formatted=true").json
    assert {fact["template_name"] for fact in facts} == {"domain-object", "domain-object-type"}
    found = client.get(f"{path}&formatted=true&search=NAME+O1)")
    assert [fact["formatted"] for fact in found.json] == ["(domain-object (type t) (name o1))"]
    assert found.headers["X-Total-Count"] == "1"
    assert client.get(f"{path}&search=o1").headers["X-Total-Count"] == "11"
    assert client.get("/api/clips/executive/facts?template=nope").json == []


def test_rules_by_name(client):
    rules = client.get("/api/cxbridge/rules?name=mini-*&search=DISPATCH").json
    assert [rule["name"] for rule in rules] == ["mini-dispatch"]
    path = "/api/cxbridge/rules?name=mini-*"
    whole = client.get(path).json
    part = client.get(f"{path}&offset=1&limit=2")
    assert (part.json, part.headers["X-Total-Count"]) == (whole[1:3], str(len(whole)))
    assert {rule["name"]: rule["agenda"] for rule in whole}["mini-thing"] == 4
    assert client.get("/api/cxbridge/rules?name=nope").headers["X-Total-Count"] == "0"
