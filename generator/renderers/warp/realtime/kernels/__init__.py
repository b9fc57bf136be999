"""Light on a lattice of points, its interpolation, shadows, clear coats and glass."""
