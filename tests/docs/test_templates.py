"""The table of templates in the manual is that of the core."""

from tests.docs.templates import PAGE, TABLE, rows


def test_the_table_is_that_of_the_core():
    found = TABLE.search(PAGE.read_text())
    assert found is not None
    assert found[0].split("\n") == [*rows(), "", ""], "run: python -m tests.docs.templates"
