"""Fog, falling particles, wet and snowy ground, reflections in water."""
