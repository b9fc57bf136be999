"""Files of photographs: lossless PNG, or smaller ones with a loss that viewers rarely notice."""

from typing import Literal

from pydantic import Field, model_validator

from gen_data.config.base_model import Strict
from gen_data.core.capture import ImageEncoding

DEFAULT_QUALITY = 92


class RgbEncoding(Strict):
    """Encoding of the files of the rgb channel; all other channels are PNG.

    Attributes:
        format: png, jpeg, webp, or webp_lossless.
        quality: Quality of jpeg and webp, from 1 to 100.
    """

    format: Literal["png", "jpeg", "webp", "webp_lossless"] = "png"
    quality: int = Field(DEFAULT_QUALITY, ge=1, le=100)

    @model_validator(mode="after")
    def _has_a_quality(self) -> "RgbEncoding":
        if "quality" in self.model_fields_set and self.format in ("png", "webp_lossless"):
            raise ValueError(f"{self.format} has no loss: leave out quality, or use jpeg or webp")
        return self

    def described(self) -> ImageEncoding:
        """The encoding, without a quality for formats that have no loss."""
        if self.format in ("jpeg", "webp"):
            return ImageEncoding(self.format, self.quality)
        return ImageEncoding(self.format)
