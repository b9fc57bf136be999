"""Synthetic perception datasets: declarative scenes, headless rendering, exact labels.

The map of the packages is ARCHITECTURE.md; units, frames and pixel conventions are CONVENTIONS.md.
"""
