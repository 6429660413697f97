"""Door: a companion process that owns every port of the robot side, so that no stranger reaches the process that ticks.

client.py: our end, in the process that ticks; it imports no ZeroMQ. keeper.py: the companion. held.py: what the keeper
holds until it is asked. messages.py: what they say to each other, over one bounded channel.
"""
