"""Reduced models beside the full ones they stand for."""
