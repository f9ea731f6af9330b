"""The overhead camera: where it is, what robots wear, and who is where."""
