"""The laboratory that is not there: robots, their program, arena, camera and operator."""
