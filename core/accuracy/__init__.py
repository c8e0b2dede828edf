"""What accuracy costs: sources of error of full load hours, rounds until a target or a time is reached.

In: Transfer, Energy, weather. Out: YieldErrors, better Transfers, the error budget. Read first: yield_errors.py,
refine.py.
"""
