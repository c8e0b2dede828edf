"""Results: energy, tables, what single faces yield, comparison and export.

In: a Session with a Transfer, weather.
Out: a Session with Energy, face attributes, tables of the panel, files.
Read first: `compute_energy`.
"""
