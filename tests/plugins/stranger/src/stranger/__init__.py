"""One plug-in of every kind, written from the Protocols of ``core.interfaces`` alone."""
