"""World model facts of the built-in core: IDs and keys, conflicts, facts of other templates.

The tables are those of the compatibility page on the behaviour of the CX core, sections 6.1 and 6.3.
"""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.executive.host.values import FALSE, NIL, Symbol, Value
from tests.executive.core.core_bench import Bench
from tests.support import many

FILES = ("worldmodel.clp", "wm-template-facts.clp")


@pytest.fixture(scope="module")
def shared() -> Bench:
    """For tests of functions, which leave nothing behind."""
    return Bench(*FILES)


@pytest.fixture
def bench() -> Bench:
    return Bench(*FILES)


def symbols(text: str) -> tuple[Symbol, ...]:
    return tuple(Symbol(word) for word in text.split())


@pytest.mark.parametrize(
    ("fact_id", "key"),
    [
        ("/wm/pose", "wm pose"),
        ("wm//pose/", "wm pose"),
        ("/wm/7/2.5", "wm 7 2.5"),
        ("/domain/fact/at?robot=R-1", "domain fact at args? robot R-1"),
        ("/a?x=1&y=2", "a args? x 1 y 2"),
        ("/a?x=1,2,3&y=b", "a args? x [ 1 2 3 ] y b"),
        ("/a?x=1,", "a args? x [ 1 ]"),
        ("/a?x=,", "a args? x [ ]"),
        ("/a?x=", "a args? x [ ]"),
        ("/a?x", "a args? x [ ]"),
        ("/a?", "a args?"),
        ("/a?x=1?y", "a args? x 1?y"),
        ("?x=1", "args? x 1"),
        ("", ""),
        ("/", ""),
    ],
)
def test_id_to_key(shared: Bench, fact_id: str, key: str) -> None:
    assert shared.env.call("wm-id-to-key", fact_id) == symbols(key)


def test_parameter_with_two_equal_signs_is_invalid(bench: Bench) -> None:
    assert bench.env.call("wm-id-to-key", "/a?x=1=2") == symbols("a args? INVALID x=1=2")
    assert bench.texts("W") == ["Param 'x=1=2' not of format name=value, ignoring"]


@pytest.mark.parametrize(
    ("key", "fact_id"),
    [
        ("wm pose", "/wm/pose"),
        ("a args? x 1 y 2", "/a?x=1&y=2"),
        ("a args? x [ 1 2 3 ] y b", "/a?x=1,2,3&y=b"),
        ("a args? x [ 1 ]", "/a?x=1"),
        ("a args? x [ ] y [ ]", "/a?x=&y="),
        ("a args? objects [ cup plate", "/a?objects=cup"),
        ("a args?", "/a?"),
        ("", ""),
    ],
)
def test_key_to_id(shared: Bench, key: str, fact_id: str) -> None:
    assert shared.env.eval(f"(wm-key-to-id (create$ {key}))") == fact_id


_NAME = st.text("abcXYZ019_-", min_size=1, max_size=6)
_PATH = st.lists(_NAME, min_size=1, max_size=4)
_VALUE = st.one_of(_NAME, st.lists(_NAME, min_size=2, max_size=3))
_ARGS = st.lists(st.tuples(_NAME, _VALUE), max_size=3)


@settings(max_examples=many(60, 25), deadline=None)
@given(path=_PATH, args=_ARGS)
def test_ids_of_basic_names_survive_both_conversions(
    shared: Bench, path: list[str], args: list[tuple[str, str | list[str]]]
) -> None:
    pairs = [f"{name}={value if isinstance(value, str) else ','.join(value)}" for name, value in args]
    fact_id = "".join(f"/{part}" for part in path) + ("?" + "&".join(pairs) if pairs else "")
    key = shared.env.call("wm-id-to-key", fact_id)
    assert shared.env.call("wm-key-to-id", key) == fact_id
    for name, value in dict(reversed(args)).items():
        wanted: Value = Symbol(value) if isinstance(value, str) else tuple(map(Symbol, value))
        assert shared.env.call("wm-key-arg", key, Symbol(name)) == wanted


@pytest.mark.parametrize(
    ("call", "result"),
    [
        ("wm-key-arg (create$ a args? x 1 y [ b c ]) y", symbols("b c")),
        ("wm-key-arg (create$ a args? x [ y ] y 2) y", 2),
        ("wm-key-arg (create$ a args? x 1) z", NIL),
        ("wm-key-arg (create$ a x 1) x", NIL),
        ("wm-key-arg-idx (create$ wm foo args? bar x) bar", 4),
        ("wm-key-arg-idx (create$ wm foo) bar", FALSE),
        ("wm-key-arg-is-multifield (create$ a args? x [ b ]) 3", Symbol("TRUE")),
        ("wm-key-arg-is-multifield (create$ a args? x b) 3", FALSE),
        ("wm-key-arg-is-multifield (create$ a args? x) 3", FALSE),
        ("wm-key-multifield-arg-end (create$ wm foo args? x [ a b c ]) 4", 9),
        ("wm-key-multifield-arg-end (create$ wm foo args? x [ a b c) 4", 8),
        ("wm-key-prefix (create$ domain fact foo args? bar x) domain fact", Symbol("TRUE")),
        ("wm-key-prefix (create$ domain fact) domain fact foo", FALSE),
        ("wm-key-prefix (create$ domain object) domain fact", FALSE),
        ("wm-key-prefix (create$ domain)", Symbol("TRUE")),
        ("wm-key-path (create$ domain fact foo args? bar x)", symbols("domain fact foo")),
        ("wm-key-path (create$ domain fact)", symbols("domain fact")),
        ("wm-key-args (create$ domain fact foo args? bar x)", symbols("args? bar x")),
        ("wm-key-args (create$ domain fact)", ()),
        ('wm-split-string-sym "a::b:" ":"', symbols("a b")),
    ],
)
def test_functions_on_keys(shared: Bench, call: str, result: Value) -> None:
    assert shared.env.eval(f"({call})") == result


def test_fact_has_id_and_key_before_rules_fire(bench: Bench) -> None:
    bench.env.build('(defrule seen (wm-fact (id ?id) (key $?key)) => (printout t ?id " " ?key crlf))')
    bench.env.assert_string('(wm-fact (id "/a/b?x=1"))')
    bench.env.assert_string("(wm-fact (key c d))")
    bench.env.run()
    assert sorted(bench.texts()) == ["/a/b?x=1 (a b args? x 1)", "/c/d (c d)"]


@pytest.mark.parametrize("fact", ["(wm-fact)", '(wm-fact (id "/"))'])
def test_fact_without_name_fires_few_rules(bench: Bench, fact: str) -> None:
    bench.env.assert_string(fact)
    assert bench.env.run(50) < 10


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("(key a b)", '(id "/a/b")'),
        ('(id "/a/b")', '(id "a/b")'),
        ('(id "a/b")', '(id "/a/b")'),
        ('(id "a/b")', '(id "/a//b")'),
        ('(id "somewhere") (key a b)', "(key a b)"),
        ("(key a args? x [ b ])", '(id "a?x=b,") (key a args? x [ b ])'),
    ],
)
def test_newer_fact_replaces_fact_with_same_key(bench: Bench, first: str, second: str) -> None:
    bench.env.assert_string(f"(wm-fact {first} (value 1))")
    bench.env.assert_string(f"(wm-fact {second} (value 2))")
    bench.env.run()
    assert bench.one("wm-fact")["value"] == 2
    errors = bench.texts("E")
    assert errors[0].startswith("Two world model facts with the same key '(a")
    assert errors[-1] == "Erasing <Fact-1>"


# --- facts of other templates ---------------------------------------------------------------------------

_PARCEL = """(deftemplate parcel (slot id (type SYMBOL)) (slot weight (type FLOAT))
  (slot count (type INTEGER)) (slot note (type STRING)) (slot anything) (multislot stops))"""
_FACT = '(parcel (id p1) (weight 2.5) (count 3) (note "to \\"R 1\\"") (anything q) (stops a "b c" 7 0.5))'


@pytest.fixture
def parcels() -> Bench:
    bench = Bench(*FILES)
    bench.env.build(_PARCEL)
    bench.env.assert_string(_FACT)
    return bench


def _convert(bench: Bench, slots: str = "id") -> dict[str, Value]:
    bench.env.eval(
        "(do-for-fact ((?p parcel)) TRUE (assert-template-wm-fact ?p "
        f"(create$ {slots}) (deftemplate-remaining-slots parcel (create$ {slots}))))"
    )
    bench.env.run()
    return bench.one("wm-fact")


@pytest.mark.parametrize("slots", ["id", "id count", "stops id", ""])
def test_template_fact_survives_both_conversions(parcels: Bench, slots: str) -> None:
    _convert(parcels, slots)
    before = parcels.one("parcel") | {"anything": NIL}
    parcels.env.eval("(do-for-fact ((?p parcel)) TRUE (retract ?p))")
    text = parcels.env.eval("(do-for-fact ((?w wm-fact)) TRUE (template-fact-str-from-wm ?w:key ?w:values))")
    assert parcels.env.assert_string(str(text)) is not None
    assert parcels.one("parcel") == before


@pytest.mark.parametrize(
    ("value", "kind", "result"),
    [
        ("5", "STRING", "5"),
        ("5", "FLOAT", 5.0),
        ("2.7", "INTEGER", 2),
        ('"12"', "INTEGER", 12),
        ("abc", "STRING", "abc"),
        ('"a b"', "SYMBOL", Symbol("a b")),
        ("7", "SYMBOL", Symbol("7")),
    ],
)
def test_type_cast(shared: Bench, value: str, kind: str, result: Value) -> None:
    cast = shared.env.eval(f"(type-cast {value} {kind})")
    assert (type(cast), cast) == (type(result), result)
