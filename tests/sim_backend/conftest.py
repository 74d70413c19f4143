"""The simulated card behind its server, with a client's session and tasks."""

import pytest

from tests.tools.daqmx import (
    add_inputs,
    add_output,
    served,
    task,
)


@pytest.fixture
def card():
    with served() as made:
        yield made


@pytest.fixture
def session(card):
    return card.session


@pytest.fixture
def output(session):
    with task(session) as made:
        add_output(made)
        yield made


@pytest.fixture
def inputs(session):
    with task(session) as made:
        add_inputs(made)
        yield made
