"""Renderers of other projects, and the scenes that they and this project's renderer draw."""
