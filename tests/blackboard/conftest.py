"""Failing asserts of the contract modules show their values, too."""

import pytest

pytest.register_assert_rewrite("tests.blackboard.contract")
