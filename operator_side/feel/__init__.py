"""From onset distances to trigger effects and rumble."""
