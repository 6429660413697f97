"""Rendering of onset distances as trigger resistance and rumble."""
