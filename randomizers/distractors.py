"""Unlabelled objects that occlude others."""

from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.config.base_model import NAME_PATTERN
from gen_data.randomizers.objects import COUNT_MAX, Objects


class Distractors(Objects):
    """Draws the objects of a group that the template does not annotate.

    Distractors have an instance id in the masks: occlusion by them is counted.

    Attributes:
        count: Number of distractors.
    """

    type: Literal["distractors"] = "distractors"  # type: ignore[assignment]
    name: str = Field("distractors", pattern=NAME_PATTERN)
    count: Annotated[dist.Count, dist.Bounds(0, COUNT_MAX)] = dist.UniformInteger(0, 4)
