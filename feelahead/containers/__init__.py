"""Run robot side, operator side and a router between them in containers; docker/ has the images and compose file."""
