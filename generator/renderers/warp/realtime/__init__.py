"""The realtime tier: direct lighting, soft shadows, clear coats and glass."""
