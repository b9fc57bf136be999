"""Laser rays through the same scene that cameras see."""
