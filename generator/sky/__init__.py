"""Sky and sun: luminance and illuminance at any time of day, under any clouds."""
