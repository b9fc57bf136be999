"""Rooms: rules per type, floor plans with openings, and layouts that keep the rules."""
