"""Looking at samples: contact sheets (PNG) and Rerun recordings."""
