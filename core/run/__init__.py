"""The application, for the command line, Python and Blender alike: runs, further rounds, variants,
comparisons, and what a run writes.

In: paths and a Request; a log. Out: results in a folder that is whole or not there. Read first:
simulate.py.
"""
