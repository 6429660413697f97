"""What stands behind the simulated arm and camera, in plain NumPy; arm.py and scene.py put it into MuJoCo."""
