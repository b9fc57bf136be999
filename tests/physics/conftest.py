"""Both engines, as far as they are installed: the same tests hold for each."""

from collections.abc import Iterator

import pytest

from gen_data.physics import PhysicsConfig
from gen_data.physics.engine import Engine
from gen_data.physics.open_world import open_world
from gen_data.physics.physics_config import EngineName
from gen_data.physics.world import World
from tests.physics.doubles import Solids
from tests.wheels import INSTALLED


@pytest.fixture(params=INSTALLED)
def engine_name(request: pytest.FixtureRequest) -> EngineName:
    name: EngineName = request.param
    return name


@pytest.fixture
def engine(engine_name: EngineName) -> Iterator[Engine]:
    with Engine(Solids(), PhysicsConfig(engine=engine_name)) as opened:
        yield opened


@pytest.fixture
def world(engine_name: EngineName) -> Iterator[World]:
    """An empty world."""
    opened = open_world(PhysicsConfig(engine=engine_name))
    opened.reset()
    yield opened
    opened.close()
