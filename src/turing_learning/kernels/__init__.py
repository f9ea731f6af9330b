"""Compiled functions on floats and arrays; nothing here knows of scenarios, evolution or files.

Running swarms (docs/physics.md): `trials` runs trials from start to end. In each control cycle
`sensing` reads the sensors, `motion` commands the wheels, by networks where these drive, with
noise, and moves free robots in closed form, and `stepping` finds the bodies that may touch
something, and advances them in small steps. With many bodies, searches go through `tiles` instead
of all pairs. `world` holds what is constant and what changes.

`court`: one robot among posts that it can push, and its infrared sensors.

Judging: `elman` and `elman_source`. For both: `compile` and `parallel`.
"""
