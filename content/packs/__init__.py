"""Asset packs: the table, and converters of their files."""
