"""Recordings and captures of what happened on a bus."""
