"""Composition root: a configuration becomes a Pipeline. Only this package imports every table."""
