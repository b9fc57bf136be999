"""Names of keypoints of assets that are conditions of placing things on or at them."""

from __future__ import annotations

SUPPORT = "support"
"""Keypoints at two opposite corners of a level surface that carries things and is not a top."""
INSIDE = "inside"
"""Keypoints at the lowest and the highest corner of the room above a board behind doors."""
BACKREST = "backrest"
"""Keypoint in the middle of the upper edge of a back."""
TAP, DRAIN = "tap", "drain"
"""Keypoints where water comes out of a tap, and where it falls to."""
