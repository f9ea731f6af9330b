"""What is said to robots, and heard from them."""
