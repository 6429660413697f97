"""What the fingers get: stiffness becomes trigger effects."""
