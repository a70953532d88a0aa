"""World model and domain of the built-in core follow each other's changes.

The table of events is that of the compatibility page on the behaviour of the CX core, section 6.4. Everything
that modifies facts is done in two ways: as an agent's file does (the fact gets a new index) and as the core
does (the index stays).
"""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.executive.host.values import FALSE, TRUE, Symbol
from tests.executive.core.core_bench import Bench
from tests.support import many

FILES = (
    "plan.clp",
    "goal.clp",
    "domain.clp",
    "worldmodel.clp",
    "cx-identity.clp",
    "wm-domain-sync.clp",
    "wm-domain-sync-facts.clp",
    "wm-domain-sync-objects.clp",
)

_AGENT = """
(deffunction agent-set (?id $?value)
  (do-for-fact ((?f wm-fact)) (eq ?f:id ?id)
    (if ?f:is-list then (modify ?f (values ?value)) else (modify ?f (value (nth$ 1 ?value))))))
(deffunction agent-set-type (?id ?type) (do-for-fact ((?f wm-fact)) (eq ?f:id ?id) (modify ?f (type ?type))))
"""

MODIFYING = pytest.mark.parametrize("bench", ["agent", "core"], indirect=True)


class SyncBench(Bench):
    """The world model, the domain, and operations that change them.

    :param modifier: ``agent`` or ``core``: the way of modification.
    """

    def __init__(self, modifier: str, folder: Path) -> None:
        super().__init__(*FILES)
        agent = folder / "agent.clp"
        agent.write_text(_AGENT)
        if modifier == "agent":
            self.env.batch(agent)
        else:
            for part in _AGENT.strip().split("\n(deffunction "):
                self.env.build(part if part.startswith("(") else f"(deffunction {part}")
        self.env.assert_string("(domain-loaded)")

    def domain(self, *atoms: str) -> None:
        """Assert domain-facts and run."""
        for atom in atoms:
            name, _, values = atom.partition(" ")
            self.env.assert_string(f"(domain-fact (name {name}) (param-values {values}))")
        self.env.run()

    def not_domain(self, atom: str) -> None:
        """Retract a domain-fact and run."""
        name, _, values = atom.partition(" ")
        self.drop("domain-fact", f"(and (eq ?f:name {name}) (eq ?f:param-values (create$ {values})))")

    def drop(self, template: str, condition: str) -> None:
        """Retract facts and run."""
        self.env.eval(f"(do-for-all-facts ((?f {template})) {condition} (retract ?f))")
        self.env.run()

    def wm(self, fact_id: str, value: str = "TRUE", kind: str = "BOOL") -> None:
        """Assert a wm-fact and run."""
        self.env.assert_string(f'(wm-fact (id "{fact_id}") (type {kind}) (value {value}))')
        self.env.run()

    def wm_becomes(self, fact_id: str, *value: str) -> None:
        """Modify the value of a wm-fact and run."""
        self.env.call("agent-set", fact_id, *map(Symbol, value))
        self.env.run()

    def not_wm(self, fact_id: str) -> None:
        """Retract a wm-fact and run."""
        self.drop("wm-fact", f'(eq ?f:id "{fact_id}")')

    def keep(self, fact_id: str) -> None:
        """Keep the wm-fact after the retraction of its domain-fact."""
        self.env.call("wm-sync-set-wm-fact-retract", fact_id, FALSE)

    def atoms(self) -> list[str]:
        """Return the domain-facts."""
        return sorted(" ".join(map(str, (f["name"], *f["param-values"]))) for f in self.all("domain-fact"))

    def known(self) -> dict[str, str]:
        """Return values of the wm-facts by ID; of lists, the elements."""
        return {
            str(f["id"]): " ".join(map(str, f["values"])) if f["is-list"] == TRUE else str(f["value"])
            for f in self.all("wm-fact")
            if f["id"] != _OBJECTS_OF_TYPE_OBJECT
        }

    def objects(self) -> set[str]:
        """Return the names of the domain-objects."""
        return {str(fact["name"]) for fact in self.all("domain-object")}

    def consistent(self) -> None:
        """Check the records of the synchronisation against the facts."""
        atoms = {0, *(index for index, _, _ in self.env.facts("domain-fact"))}
        for entry in self.all("wm-sync-map-fact"):
            assert entry["domain-fact-idx"] in atoms, entry
            assert (entry["wm-fact-idx"] != 0) == (entry["wm-fact-id"] in self.known()), entry


_OBJECTS_OF_TYPE_OBJECT = "/domain/objects-by-type/object"  # the domain always has that type
HELLO = "/domain/fact/said?c=hello"
OPEN = "/domain/fact/open"
ROBOT = "/domain/fact/at?robot=R-1&place=P-2"


@pytest.fixture
def bench(request: pytest.FixtureRequest, tmp_path: Path) -> SyncBench:
    bench = SyncBench(getattr(request, "param", "agent"), tmp_path)
    for name, params in (("said", "c"), ("at", "robot place"), ("open", "")):
        bench.env.assert_string(f"(domain-predicate (name {name}) (param-names {params}))")
    bench.env.run()
    return bench


# --- facts: the table -------------------------------------------------------------------------------------


@MODIFYING
def test_domain_follows_value_of_own_wm_fact(bench: SyncBench) -> None:
    bench.domain("said hello")
    bench.wm_becomes(HELLO, "FALSE")
    assert (bench.atoms(), bench.known()) == ([], {HELLO: "FALSE"})
    bench.domain("said hello")
    assert bench.known() == {HELLO: "TRUE"}
    bench.wm_becomes(HELLO, "FALSE")
    assert bench.atoms() == []


@MODIFYING
def test_domain_follows_boolean_values_only(bench: SyncBench) -> None:
    bench.wm(HELLO, "TRUE", "UNKNOWN")
    bench.wm_becomes(HELLO, "FALSE")
    assert bench.atoms() == ["said hello"]
    bench.env.call("agent-set-type", HELLO, Symbol("BOOL"))
    bench.env.run()
    assert bench.atoms() == []


# --- facts: both sides at once, and odd ones --------------------------------------------------------------


def test_late_predicate_is_synchronised(bench: SyncBench) -> None:
    bench.domain("heard hello")
    bench.wm("/domain/fact/heard?c=goodbye")
    assert bench.known() == {"/domain/fact/heard?c=goodbye": "TRUE"}
    bench.env.assert_string("(domain-predicate (name heard) (param-names c))")
    bench.env.run()
    assert bench.atoms() == ["heard goodbye", "heard hello"]
    assert set(bench.known()) == {"/domain/fact/heard?c=goodbye", "/domain/fact/heard?c=hello"}


def test_order_of_arguments_is_irrelevant(bench: SyncBench) -> None:
    """A wm-fact names its arguments. (The original core uses their order, and loses the fact.)"""
    bench.wm("/domain/fact/at?place=P-2&robot=R-1")
    assert bench.atoms() == ["at R-1 P-2"]
    bench.not_domain("at R-1 P-2")
    assert bench.known() == {}


def test_list_among_arguments_is_an_error(bench: SyncBench) -> None:
    bench.wm("/domain/fact/at?robot=R-1,R-2&place=x")
    assert bench.atoms() == []
    assert [text for text in bench.texts("E") if "may not contain argument value list" in text]


def test_domain_fact_with_too_few_values_is_an_error(bench: SyncBench) -> None:
    bench.domain("at R-1")
    assert bench.known() == {}
    assert len(bench.texts("E")) == 1


_OPERATIONS = st.lists(
    st.tuples(
        st.sampled_from(["domain", "not_domain", "wm", "wm_false", "wm_true", "not_wm", "keep", "drop_keep"]),
        st.sampled_from(["hello", "goodbye"]),
        st.booleans(),
    ),
    max_size=25,
)


@pytest.mark.parametrize("modifier", ["agent", "core"])
def test_random_changes_end_consistent(modifier: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    """After each run, wm-facts and domain have the same content."""
    folder = tmp_path_factory.mktemp("any")

    @settings(max_examples=many(25, 10), deadline=None)
    @given(operations=_OPERATIONS)
    def check(operations: list[tuple[str, str, bool]]) -> None:
        bench = SyncBench(modifier, folder)
        bench.env.assert_string("(domain-predicate (name said) (param-names c))")
        for operation, word, run in operations:
            fact_id = f"/domain/fact/said?c={word}"
            _apply(bench, operation, word, fact_id)
            if run:
                assert bench.env.run(300) < 300
                bench.consistent()
                assert {
                    f"said {i.partition('=')[2]}" for i, v in bench.known().items() if v == "TRUE"
                } == set(bench.atoms())
        bench.env.destroy()

    check()


def _apply(bench: SyncBench, operation: str, word: str, fact_id: str) -> None:
    if operation == "domain":
        bench.env.assert_string(f"(domain-fact (name said) (param-values {word}))")
    elif operation == "not_domain":
        bench.env.eval(f"(do-for-all-facts ((?f domain-fact)) (member$ {word} ?f:param-values) (retract ?f))")
    elif operation == "wm" and fact_id not in bench.known():
        bench.wm(fact_id)  # with a run: a new fact counts as true, whatever its value
    elif operation in ("wm_true", "wm_false"):
        bench.env.call("agent-set", fact_id, Symbol(operation[3:].upper()))
    elif operation == "not_wm":
        bench.env.eval(f'(do-for-all-facts ((?f wm-fact)) (eq ?f:id "{fact_id}") (retract ?f))')
    elif operation in ("keep", "drop_keep"):
        bench.env.call("wm-sync-set-wm-fact-retract", fact_id, Symbol(str(operation == "drop_keep").upper()))


# --- expectations of the original's tests -------------------------------------------------------------------


# --- remapped paths -----------------------------------------------------------------------------------------


def test_id_prefixes_name_predicates(bench: SyncBench) -> None:
    bench.env.call("wm-sync-remap-fact-id-prefix", "/wm/said", "/hardware/gripper/open")
    bench.domain("said hello", "open", "at R-1 P-2")
    assert set(bench.known()) == {"/wm/said?c=hello", "/hardware/gripper/open", ROBOT}
    bench.wm("/wm/said?c=goodbye")
    bench.wm("/domain/fact/said?c=ignored")
    assert bench.atoms() == ["at R-1 P-2", "open", "said goodbye", "said hello"]
    bench.not_wm("/hardware/gripper/open")
    assert "open" not in bench.atoms()


def test_remapping_is_configured_before_first_synchronisation(bench: SyncBench) -> None:
    for path, value in (
        ("/clips-executive/spec", "s"),
        ("/clips-executive/specs/s/wm-remap/facts/id-prefix", ("/wm/said", "/wm/at")),
        ("/clips-executive/specs/s/wm-remap/facts/name-id/open", "/door/state"),
        ("/clips-executive/specs/s/wm-remap/objects/name-id/text", "/wm/words"),
        ("/clips-executive/specs/other/wm-remap/facts/name-id/said", "/elsewhere"),
    ):
        bench.config(path, value)
    for fact in ("(executive-init)", "(domain-object-type (name text))"):
        bench.env.assert_string(fact)
    bench.domain("said hello", "open", "at R-1 P-2")
    assert set(bench.known()) == {
        "/wm/said?c=hello",
        "/door/state",
        "/wm/at?robot=R-1&place=P-2",
        "/wm/words",
    }
    assert len(bench.all("confval")) == 2


# --- objects ----------------------------------------------------------------------------------------------

TEXTS = "/domain/objects-by-type/text"


@pytest.fixture
def objects(bench: SyncBench) -> SyncBench:
    bench.env.assert_string("(domain-object-type (name text))")
    bench.env.run()
    for name in ("a", "b"):
        bench.env.assert_string(f"(domain-object (name {name}) (type text))")
        bench.env.run()
    return bench


def test_list_of_type_has_objects_of_that_type_only(objects: SyncBench) -> None:
    for fact in (
        "(domain-object-type (name word) (super-type text))",
        "(domain-object (name w) (type word))",
    ):
        objects.env.assert_string(fact)
    objects.env.run()
    assert objects.known()[TEXTS] == "a b"
    assert objects.known()["/domain/objects-by-type/word"] == "w"
    listed = objects.one("wm-fact", id=TEXTS)
    assert (listed["key"], listed["type"]) == (("domain", "objects-by-type", "text"), Symbol("SYMBOL"))


def test_objects_of_one_run_are_listed_in_reverse(bench: SyncBench) -> None:
    """As in the recordings: the activation made last fires first."""
    bench.env.assert_string("(domain-object-type (name text))")
    bench.env.run()
    for name in ("hello", "goodbye"):
        bench.env.assert_string(f"(domain-object (name {name}) (type text))")
    bench.env.run()
    assert bench.known()[TEXTS] == "goodbye hello"


def test_list_is_written_once_for_all_objects(objects: SyncBench) -> None:
    objects.env.build(
        "(defrule written (declare (salience 9000))"
        f' (wm-fact (id "{TEXTS}") (values $?names)) => (printout t (length$ ?names) crlf))'
    )
    for number in range(50):
        objects.env.assert_string(f"(domain-object (name o{number}) (type text))")
    objects.env.run()
    objects.drop("domain-object", "(neq ?f:name a)")
    assert objects.texts() == ["2", "52", "1"]


@MODIFYING
def test_replaced_list_replaces_objects(objects: SyncBench) -> None:
    """The original core drops new objects if a listed object is missing."""
    objects.wm_becomes(TEXTS, "b", "c", "d")
    assert objects.objects() == {"b", "c", "d"}
    assert objects.known()[TEXTS] == "b c d"


@MODIFYING
def test_changed_list_wins_over_changed_objects(objects: SyncBench) -> None:
    objects.env.call("agent-set", TEXTS, *map(Symbol, "ac"))
    objects.env.assert_string("(domain-object (name z) (type text))")
    objects.drop("domain-object", "(eq ?f:name a)")
    assert objects.objects() == {"a", "c"}
    assert objects.known()[TEXTS] == "a c"


# --- functions --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [50, 200])
def test_firings_of_new_fact_are_independent_of_number_of_facts(bench: SyncBench, count: int) -> None:
    bench.domain(*(f"at R-{number} P-2" for number in range(count)))
    bench.env.assert_string("(domain-fact (name at) (param-values R-x P-2))")
    assert bench.env.run() == 2
