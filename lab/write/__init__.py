"""Configurations from a sentence, by any language model; its replies are foreign input."""
