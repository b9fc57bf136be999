"""A factory on its way to another process."""

import pickle

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory


def test_a_factory_takes_its_categories_along_and_leaves_its_scenes_behind() -> None:
    """Finding categories out takes as long as building every nominal scene."""
    factory = PipelineFactory(load_config("tabletop.yaml"), n=10)
    assert factory.nominal

    arrived = pickle.loads(pickle.dumps(factory))

    assert not {"nominal", "library"} & vars(arrived).keys()
    assert vars(arrived)["categories"] == factory.categories
    assert arrived().info == factory().info
