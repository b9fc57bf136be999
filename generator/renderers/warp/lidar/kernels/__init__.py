"""Laser rays: first hits, returns, mirrors and packets of rays."""
