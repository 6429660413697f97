"""Off-screen drawing of a MuJoCo model, for pictures that people see and for those that a depth camera takes."""
