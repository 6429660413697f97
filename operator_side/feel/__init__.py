"""What the fingers get: what lies ahead becomes trigger effects."""
