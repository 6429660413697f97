"""From overlaps to what the fingers are to feel (§4.2)."""
