"""Rendering of onset distances as trigger effects and rumble."""
