"""Compiled functions on floats and arrays; nothing here knows of scenarios, evolution or files.

Running swarms (docs/physics.md): `trials` runs trials from start to end. In each control cycle `sensing` reads the sensors,
`motion` commands the wheels, with noise, and moves free robots in closed form, and `involved` finds the bodies that may touch
something, gathers them in a party and lets `stepping` advance them. With many bodies, searches go through `tiles` instead of all
pairs. `networks` drive the robots that are not reactive. `world` holds what is constant and what changes, `geometry` the angles.

Judging: `elman` and `elman_source`. For both: `compile` and `parallel`.
"""
