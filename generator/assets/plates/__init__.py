"""Photographs as plates: estimation of their cameras, and their light."""
