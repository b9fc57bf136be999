"""Names of keypoints that an asset needs for objects to be placed on it or at it."""

SUPPORT = "support"
"""Keypoints at two opposite corners of a level surface, other than the top, that carries
objects."""
INSIDE = "inside"
"""Keypoints at the lowest and the highest corner of the room above a board behind doors."""
BACKREST = "backrest"
"""Keypoint in the middle of the upper edge of a back."""
TAP, DRAIN = "tap", "drain"
"""Keypoints where water comes out of a tap, and where it falls to."""
