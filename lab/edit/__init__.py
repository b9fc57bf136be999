"""A live page for configurations and data sets: ``gen-data edit``."""
