"""One third-party plug-in of every kind, written from ``core.interfaces`` alone."""
