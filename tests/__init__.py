import pytest

# suites that test files derive from: their asserts shall say what they compared
pytest.register_assert_rewrite("tests.tools.rig_contract")
