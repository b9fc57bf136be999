"""A Gymnasium environment over scenes with a robot arm."""
