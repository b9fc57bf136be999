"""Event camera: the sensor and the model of its pixels."""
