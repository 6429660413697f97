"""`feelahead bench coverage`: does full stiffness stand in time, and how often without need?"""
