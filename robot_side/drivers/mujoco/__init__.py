"""The simulated world behind the arm's and the camera's ports; only here and in the cameras is MuJoCo known."""
