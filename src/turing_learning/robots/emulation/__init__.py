"""The emulated laboratory: robots, their program, arena, camera and operator."""
