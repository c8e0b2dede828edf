"""The Transfer: weather-independent relative irradiance of every surface, and what both estimators share.

In: patches and light. Out: Transfer. Read first: transfer.py.
"""
