"""Renderers of others, and the scenes that they draw beside this project's."""
