"""What the user asks for, and what every room needs: the one error, progress, threads, checks of
arrays.

In: numbers and words from the command line or Blender. Out: Request. Read first: setting.py,
request.py.
"""
