"""Both engines, as far as they are installed: the same tests hold for each."""

from collections.abc import Iterator

import pytest

from gen_data.physics import PhysicsConfig
from gen_data.physics.engine import Engine
from gen_data.physics.physics_config import EngineName
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
