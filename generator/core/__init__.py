"""The nouns: frozen data and small pure functions, on numpy and the standard library only."""
