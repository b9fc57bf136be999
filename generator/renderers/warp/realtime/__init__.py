"""The realtime tier: direct light, soft shadows, clear coats and glass."""
