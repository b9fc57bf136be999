"""Previews of samples: contact sheets (PNG) and Rerun recordings."""
