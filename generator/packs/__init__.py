"""Asset packs: published packages, fetched in a pinned version and converted once."""
