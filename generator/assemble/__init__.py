"""Composition root: a configuration becomes a Pipeline. The one package that knows every table."""
