"""Tests that every rig, laser driver and amplifier driver must pass, for their authors.

They need pytest, which the program itself does not need. For pytest's detailed failures call
``pytest.register_assert_rewrite("dearig.drivers.contract")`` in ``conftest.py``, before the import.
"""
