"""The Transfer: weather-independent relative irradiance of every surface, and what both estimators share.

In: patches and light. Out: Transfer, the plan of effects, closed forms of open patches. Read first: transfer.py.
"""
