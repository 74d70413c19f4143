"""Tests that a rig, a laser or an amplifier must pass, for whoever brings one.

They need pytest, which this program itself does not. Have pytest explain failures in them:
``pytest.register_assert_rewrite("dearig.drivers.contract")`` in ``conftest.py``, before the import.
"""
