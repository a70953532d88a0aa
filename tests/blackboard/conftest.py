"""Failed asserts of the contract modules show their values."""

import pytest

pytest.register_assert_rewrite("tests.blackboard.contract")
