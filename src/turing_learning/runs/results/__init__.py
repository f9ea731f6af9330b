"""What a run has inferred, how it is shown, and several runs told as one."""
