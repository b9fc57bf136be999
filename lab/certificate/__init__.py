"""Certificates: claims about a finished data set, each checked by something independent of it."""
