"""One plug-in of every kind, written from the Protocols of ``generator.core.interfaces`` alone."""
