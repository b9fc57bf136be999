"""Tables of content next to the modules: typed rows by key, in the file's order."""

from pathlib import Path

import pytest
import yaml

from gen_data import assets
from gen_data.config.data_files import load_table
from gen_data.content.procedural.bottles import BOTTLES, BottleStyle
from gen_data.content.vehicles.car_design import DESIGNS, Design

VEHICLES = "gen_data.content.vehicles"
TABLES = sorted(Path(assets.__path__[0]).rglob("*.yaml"))


def test_rows_have_the_type_of_the_table_in_the_order_of_the_file() -> None:
    """Lists become tuples, whole numbers fractions where the field is one."""
    wine = BOTTLES["wine"]
    assert isinstance(wine, BottleStyle)
    assert wine.height_m == (0.29, 0.32)
    assert isinstance(wine.depth, float)
    assert not wine.clear
    # Seeds take the styles in turn; an estate is a sedan with other measures.
    assert " ".join(BOTTLES) == (
        "wine beer water soda ketchup detergent burgundy champagne white_wine longneck stubby "
        "ribbed family juice milk oil spirit sauce shampoo soap spray flask sport medicine squeeze "
        "tinted waisted crushed"
    )
    sedan, estate = DESIGNS["sedan"], DESIGNS["estate"]
    assert (sedan.rails, estate.rails) == (False, True)
    assert estate.width_m == sedan.width_m
    with pytest.raises(KeyError):
        load_table(VEHICLES, "bicycles", Design)


@pytest.mark.parametrize("path", TABLES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_no_key_is_given_twice(path: Path) -> None:
    for node in _mappings(yaml.compose(path.read_text("utf-8"))):
        keys = [key.value for key, _ in node.value]
        assert len(keys) == len(set(keys)), path


def _mappings(node: yaml.Node) -> list[yaml.MappingNode]:
    if isinstance(node, yaml.MappingNode):
        return [node, *(m for _, value in node.value for m in _mappings(value))]
    if isinstance(node, yaml.SequenceNode):
        return [m for item in node.value for m in _mappings(item)]
    return []
